#include <holdfast/pcl/contact_risk_estimation.h>

#include "parallel/parallel_for.h"
#include <holdfast/contact/foothold.h>
#include <holdfast/pcl/conversions.h>

#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/impl/pcl_base.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

namespace holdfast {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Nothing for a point that is no patch.
std::optional<ContactSurface>
surfaceOf(const PatchPoint& point)
{
  try {
    const ExtractedPatch patch = toExtractedPatch(point);
    if (!isAccepted(patch) || !patch.fit.state.centre.allFinite())
      return std::nullopt;
    return contactSurfaceOf(patch.fit);
  }
  catch (const std::invalid_argument&) { // of no type that we know
    return std::nullopt;
  }
}

FootholdPoint
noFoothold(const ContactRisk& risk)
{
  FootholdPoint point;
  point.getVector3fMap().setConstant(kNaN);
  point.getNormalVector3fMap().setConstant(kNaN);
  std::fill(std::begin(point.orientation), std::end(point.orientation), kNaN);
  std::fill(std::begin(point.pose_covariance), std::end(point.pose_covariance), kNaN);
  point.slip = point.height = point.tilt = point.gap = kNaN;
  point.total = point.joint = kNaN;
  point.cvar_gap = point.contact_area = point.yaw = kNaN;
  point.support = static_cast<float>(1.0 - risk.support_share);
  point.status = static_cast<std::uint8_t>(risk.status);
  return point;
}

FootholdPoint
footholdPoint(const ContactRisk& risk, double yaw)
{
  if (!risk.quality)
    return noFoothold(risk);
  const ContactQuality& quality = *risk.quality;
  FootholdPoint point;
  point.getVector3fMap() = quality.pose.c.cast<float>();
  point.getNormalVector3fMap() = quality.pose.R.col(2).cast<float>();
  const Eigen::Quaternionf q(Eigen::Quaterniond(quality.pose.R).cast<float>());
  point.orientation[0] = q.w();
  point.orientation[1] = q.x();
  point.orientation[2] = q.y();
  point.orientation[3] = q.z();
  int slot = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j)
      point.pose_covariance[slot++] = static_cast<float>(quality.pose_covariance(i, j));
  point.slip = static_cast<float>(quality.risk.slip);
  point.height = static_cast<float>(quality.risk.height);
  point.tilt = static_cast<float>(quality.risk.tilt);
  point.gap = static_cast<float>(quality.risk.gap);
  point.support = static_cast<float>(quality.risk.support);
  point.total = static_cast<float>(quality.risk.total);
  point.joint = static_cast<float>(quality.risk.joint);
  point.cvar_gap = static_cast<float>(quality.cvar_gap_m);
  point.contact_area = static_cast<float>(quality.contact_area_m2);
  point.yaw = static_cast<float>(yaw);
  point.status = static_cast<std::uint8_t>(risk.status);
  return point;
}

} // namespace

std::string
ContactRiskEstimation::inputError() const
{
  if (std::string error = validityError(foot_); !error.empty())
    return foot_.sole.empty() ? "no foot: setFoot()" : error;
  FootholdOptions options;
  options.load_direction = load_direction_;
  options.yaws = yaws_;
  options.threads = threads_;
  if (std::string error = validityError(options); !error.empty())
    return error;
  const auto size = static_cast<pcl::index_t>(input_->size());
  const bool is_inside =
      std::all_of(indices_->begin(), indices_->end(), [size](pcl::index_t index) {
        return index >= 0 && index < size;
      });
  return is_inside ? "" : "an index is out of range";
}

bool
ContactRiskEstimation::initCompute()
{
  // Not the base's: it would ask for a radius and build a search tree.
  if (!pcl::PCLBase<PatchPoint>::initCompute())
    return false;
  const std::string error = inputError();
  if (!error.empty())
    PCL_ERROR("[holdfast::%s::compute] %s!\n", getClassName().c_str(), error.c_str());
  return error.empty();
}

void
ContactRiskEstimation::computeFeature(PointCloudOut& output)
{
  output.sensor_origin_ = input_->sensor_origin_;
  output.sensor_orientation_ = input_->sensor_orientation_;
  parallelFor(static_cast<int>(indices_->size()), threads_, [&](int item, int) {
    const auto i = static_cast<std::size_t>(item);
    const pcl::index_t index = (*indices_)[i];
    Placement placement;
    placement.load_direction = load_direction_;
    ContactRisk risk; // without a surface: no support
    if (const auto surface = surfaceOf((*input_)[static_cast<std::size_t>(index)])) {
      placement.point = surface->anchor.c;
      risk = bestYaw(*surface, foot_, placement, yaws_);
    }
    output[i] = footholdPoint(risk, placement.yaw);
    output[i].patch = index;
  });
  output.is_dense = std::all_of(output.begin(), output.end(), [](const auto& point) {
    return pcl::isFinite(point);
  });
}

} // namespace holdfast
