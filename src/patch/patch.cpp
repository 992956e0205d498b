#include "patch/canonical_axis.h"
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/patch.h>

#include <Eigen/Geometry>

#include <cmath>
#include <utility>

namespace holdfast {
namespace {

bool
hasTwoCurvatures(SurfaceType surface)
{
  return curvatureParameterCount(surface) == 2;
}

std::string
typeError(PatchType type)
{
  if (isLegal(type))
    return {};
  return "a " + std::string(surfaceName(type.surface)) + " cannot be bounded by a " +
         std::string(boundaryName(type.boundary));
}

std::string
boundsError(const Patch& patch)
{
  const bool quad = patch.type.boundary == BoundaryType::Quad;
  const int used = boundaryParameterCount(patch.type.boundary);
  const int lengths = quad ? 4 : used;
  if ((patch.d.head(lengths).array() <= 0.0).any())
    return "every bound must be greater than zero";
  // The diagonals cross at the centre, so lengths > 0 and this make the quad convex.
  if (quad && !(patch.d(4) > 0.0 && patch.d(4) < 0.5 * kPi))
    return "gamma must lie between 0 and pi/2";
  if ((patch.d.tail(5 - used).array() != 0.0).any())
    return "bounds that the boundary does not use must be zero";
  return {};
}

std::string
curvatureError(const Patch& patch)
{
  const Eigen::Vector2d& k = patch.kappa;
  const int used = curvatureParameterCount(patch.type.surface);
  if ((k.tail(2 - used).array() != 0.0).any())
    return "curvatures that the surface does not use must be zero";
  if ((k.head(used).array() == 0.0).any())
    return "a curved surface must have curvatures other than zero";
  const bool opposite = (k.x() < 0.0) != (k.y() < 0.0);
  if (patch.type.surface == SurfaceType::EllipticParaboloid && opposite)
    return "the curvatures of an elliptic paraboloid must have the same sign";
  if (patch.type.surface == SurfaceType::HyperbolicParaboloid && !opposite)
    return "the curvatures of a hyperbolic paraboloid must have opposite signs";
  return {};
}

std::string
orientationError(const Patch& patch)
{
  // A rotation by pi may come out of the logarithm a few roundings longer.
  if (patch.r.norm() > kPi * (1.0 + 1e-12))
    return "|r| must not exceed pi";
  if (isRevolute(patch.type) && patch.r.z() != 0.0)
    return "r_z must be zero for a patch with revolute symmetry";
  return {};
}

// Turns the local frame by +90 degrees about z: x' = y, y' = -x.
void
swapAxes(Patch& patch, Eigen::Matrix3d& R)
{
  const Eigen::Vector3d x = R.col(0);
  R.col(0) = R.col(1);
  R.col(1) = -x;
  std::swap(patch.d(0), patch.d(1));
  std::swap(patch.kappa.x(), patch.kappa.y());
}

// Turns the local frame by 180 degrees about z; the corners of a quad change places
// with those opposite.
void
turnHalfway(Patch& patch, Eigen::Matrix3d& R)
{
  R.leftCols<2>() *= -1.0;
  if (patch.type.boundary == BoundaryType::Quad) {
    std::swap(patch.d(0), patch.d(2));
    std::swap(patch.d(1), patch.d(3));
  }
}

// Canonical form of the patch with orientation R in place of its r.
Patch
canonicalWith(Patch patch, Eigen::Matrix3d R)
{
  if (isRevolute(patch.type)) {
    patch.r << rxyFromNormal(R.col(2)), 0.0;
    return patch;
  }
  if (hasTwoCurvatures(patch.type.surface) &&
      std::abs(patch.kappa.x()) > std::abs(patch.kappa.y()))
    swapAxes(patch, R);
  if (pointsBackwards(R.col(0)))
    turnHalfway(patch, R);
  patch.r = logMap(R);
  return patch;
}

} // namespace

Pose
Patch::pose() const
{
  return {expMap(r), c};
}

Eigen::Vector2d
Patch::principalCurvatures() const
{
  const auto along = [this](int axis) { return axis == kStraight ? 0.0 : kappa[axis]; };
  const SurfaceTraits& traits = traitsOf(type.surface);
  return {along(traits.along_x), along(traits.along_y)};
}

Eigen::Vector3d
Patch::normal() const
{
  return expMap(r).col(2);
}

std::string
validityError(const Patch& patch)
{
  if (std::string error = typeError(patch.type); !error.empty())
    return error;
  if (!patch.d.allFinite() || !patch.kappa.allFinite() || !patch.r.allFinite() ||
      !patch.c.allFinite())
    return "every parameter must be a finite number";
  for (const auto check : {boundsError, curvatureError, orientationError})
    if (std::string error = check(patch); !error.empty())
      return error;
  return {};
}

Patch
canonical(const Patch& patch)
{
  return canonicalWith(patch, expMap(patch.r));
}

Patch
transformed(const Patch& patch, const Pose& T)
{
  const Pose pose = T * patch.pose();
  Patch moved = patch;
  moved.c = pose.c;
  return canonicalWith(moved, pose.R);
}

namespace {

// The patch with its frame turned by pi/2 about z, x' = y: the same set of points.
// One-curvature cylinders are told from their axis and have no such representation.
Patch
turnedByQuarter(const Patch& patch)
{
  Patch turned = patch;
  Eigen::Matrix3d R = expMap(patch.r);
  const Eigen::Vector3d x = R.col(0);
  R.col(0) = R.col(1);
  R.col(1) = -x;
  turned.r = logMap(R);
  std::swap(turned.kappa[0], turned.kappa[1]);
  if (patch.type.boundary == BoundaryType::Quad) {
    // Corner i of the new numbering is corner i + 1 of the old.
    turned.d << patch.d[1], patch.d[2], patch.d[3], patch.d[0], 0.5 * kPi - patch.d[4];
  }
  else {
    std::swap(turned.d[0], turned.d[1]);
  }
  return turned;
}

double
angleBetween(const Patch& a, const Patch& b)
{
  return logMap(expMap(a.r).transpose() * expMap(b.r)).norm();
}

Eigen::Vector3d
nearestCoordinates(const Eigen::Vector3d& r, const Eigen::Vector3d& reference)
{
  const double angle = r.norm();
  if (angle == 0.0)
    return r;
  const Eigen::Vector3d other = r * (1.0 - 2.0 * kPi / angle);
  return (other - reference).norm() < (r - reference).norm() ? other : r;
}

} // namespace

Patch
nearestRepresentation(const Patch& patch, const Patch& reference)
{
  Patch nearest = patch;
  if (!isRevolute(patch.type)) {
    const bool cylindric = curvatureParameterCount(patch.type.surface) == 1;
    Patch candidate = patch;
    double smallest = angleBetween(patch, reference);
    for (int quarter = 1; quarter < 4; ++quarter) {
      candidate = turnedByQuarter(candidate);
      const double angle = angleBetween(candidate, reference);
      if ((cylindric && quarter != 2) || angle >= smallest)
        continue;
      smallest = angle;
      nearest = candidate;
    }
  }
  nearest.r = nearestCoordinates(nearest.r, reference.r);
  return nearest;
}

} // namespace holdfast
