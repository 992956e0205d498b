#include <holdfast/contact/contact_risk.h>

#include "contact/evaluation.h"
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/boundary.h>

#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

/// The radius of a patch's boundary as a support grid: farthest point of it.
double
extentOf(const Patch& patch)
{
  double extent = 0.0;
  // An ellipse is farthest at the ends of its sides, what has corners at those.
  for (int side = 0; side < 4; ++side)
    extent = std::max(extent, boundaryPoint(patch, side).norm());
  return extent;
}

/// Of any length that a number may have, whose square may be none.
bool
isDirection(const Eigen::Vector3d& v)
{
  return v.allFinite() && !v.isZero(0.0);
}

void
requireValid(const std::string& error)
{
  if (!error.empty())
    throw std::invalid_argument(error);
}

} // namespace

std::optional<ContactSurface>
contactSurfaceOf(const FitResult& fit)
{
  if (!isUsable(fit.status))
    return std::nullopt;
  const Patch& patch = fit.patch;
  ContactSurface surface;
  surface.anchor = patch.pose();
  const std::optional<Jet> jet = jetAt(fit, surface.anchor);
  surface.radius_m = extentOf(patch);
  if (!jet || !(surface.radius_m > 0.0))
    return std::nullopt;
  surface.jet = *jet;
  for (int row = 0; row < SupportGrid::kCells; ++row)
    for (int column = 0; column < SupportGrid::kCells; ++column) {
      const Eigen::Vector2d place(SupportGrid::middle(column),
                                  SupportGrid::middle(row));
      if (contains(patch, surface.radius_m * place))
        surface.support.set(column, row);
    }
  return surface;
}

std::string
validityError(const Placement& placement)
{
  if (!placement.point.allFinite())
    return "the point of a placement must be finite";
  if (!isDirection(placement.load_direction))
    return "the direction of the load must be finite and not zero";
  if (!std::isfinite(placement.yaw))
    return "the yaw of a placement must be finite";
  if (placement.sole_normal && !isDirection(*placement.sole_normal))
    return "the normal of the sole must be finite and not zero";
  if (placement.sole_normal && placement.sole_normal->stableNormalized().dot(
                                   placement.load_direction.stableNormalized()) >= 0.0)
    return "the normal of the sole must point against the load";
  return "";
}

Pose
loadFrame(const Placement& placement)
{
  const Eigen::Vector3d z = -placement.load_direction.stableNormalized();
  // Within a quarter of a degree of the load the x axis has no direction across it.
  constexpr double kAlong = 0.99999;
  const Eigen::Vector3d forward =
      std::abs(z.x()) < kAlong ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d x = (forward - z * z.dot(forward)).normalized();
  const Eigen::Vector3d y = z.cross(x);
  Pose pose;
  pose.R << std::cos(placement.yaw) * x + std::sin(placement.yaw) * y,
      std::cos(placement.yaw) * y - std::sin(placement.yaw) * x, z;
  pose.c = placement.point;
  return pose;
}

ContactRisk
contactRisk(const ContactSurface& surface, const Foot& foot, const Placement& placement)
{
  return contactRisks(surface, foot, placement, 1).front();
}

ContactRisk
contactRisk(const FitResult& fit, const Foot& foot, const Placement& placement)
{
  requireValid(validityError(foot));
  requireValid(validityError(placement));
  const std::optional<ContactSurface> surface = contactSurfaceOf(fit);
  return surface ? contactRisk(*surface, foot, placement) : ContactRisk();
}

std::vector<ContactRisk>
contactRisks(const ContactSurface& surface,
             const Foot& foot,
             const Placement& placement,
             int yaws)
{
  requireValid(validityError(placement));
  requireValid(yaws >= 1 ? "" : "a foot wants at least one yaw");
  contact::Evaluation evaluation(surface, foot, placement);
  std::vector<ContactRisk> risks;
  for (const contact::Sole& sole : contact::inAllDirections(contact::Sole(foot), yaws))
    risks.push_back(evaluation.at(sole));
  return risks;
}

} // namespace holdfast
