#include "patch_rays.h"

#include "patch_form.h"

#include <holdfast/fit/point_batch.h>

#include <cmath>
#include <cstddef>

namespace holdfast {

void
PatchRays::clear()
{
  x_.clear();
  y_.clear();
  measured_.clear();
}

void
PatchRays::add(double x, double y, double inverse_depth)
{
  x_.push_back(x);
  y_.push_back(y);
  measured_.push_back(inverse_depth);
}

const std::vector<double>&
PatchRays::meet(const Patch& patch, const Pose& camera)
{
  constexpr std::size_t kLanes = PointBatch::kLaneMultiple;
  const std::size_t count = x_.size();
  const std::size_t padded = (count + kLanes - 1) / kLanes * kLanes;
  x_.resize(padded, 0.0);
  y_.resize(padded, 0.0);
  met_.resize(padded);
  const Pose pose = patch.pose();
  const Eigen::Matrix3d R = camera.R.transpose() * pose.R;
  const bool is_round = traitsOf(patch.type.surface).is_round;
  kernel::kernel().meetRays(x_.data(),
                            y_.data(),
                            static_cast<int>(padded),
                            patchForm(patch, R, camera.toLocal(pose.c)),
                            is_round ? patch.kappa.x() : 0.0,
                            met_.data());
  x_.resize(count);
  y_.resize(count);
  met_.resize(count);
  return met_;
}

double
PatchRays::strayShare(const Patch& patch, const Pose& camera, double tolerance)
{
  meet(patch, camera);
  int seen = 0, stray = 0;
  for (std::size_t i = 0; i < met_.size(); ++i) {
    const bool sees = met_[i] > 0.0;
    seen += sees;
    stray += sees && std::abs(measured_[i] - met_[i]) > tolerance;
  }
  return seen > 0 ? static_cast<double>(stray) / seen : 0.0;
}

} // namespace holdfast
