#include "patch_rays.h"

#include "patch_form.h"

#include <holdfast/fit/point_batch.h>

#include <algorithm>
#include <cmath>

namespace holdfast {

void
PatchRays::makeRoom(std::size_t more)
{
  std::size_t size = std::max<std::size_t>(x_.size(), 256);
  while (size < count_ + more + PointBatch::kLaneMultiple)
    size *= 2;
  x_.resize(size);
  y_.resize(size);
  measured_.resize(size);
}

void
PatchRays::add(double x, double y, double inverse_depth)
{
  makeRoom(1);
  x_[count_] = x;
  y_[count_] = y;
  measured_[count_] = inverse_depth;
  ++count_;
}

void
PatchRays::addRow(const double* x, double y, const float* depth, int step, int count)
{
  if (count <= 0)
    return;
  makeRoom(static_cast<std::size_t>(count));
  double* const x_out = x_.data() + count_;
  double* const inverse_out = measured_.data() + count_;
  for (int i = 0; i < count; ++i) {
    x_out[i] = x[step * i];
    inverse_out[i] = 1.0 / static_cast<double>(depth[step * i]);
  }
  std::fill_n(y_.begin() + static_cast<std::ptrdiff_t>(count_), count, y);
  count_ += static_cast<std::size_t>(count);
}

const std::vector<double>&
PatchRays::meet(const Patch& patch, const Pose& camera)
{
  constexpr std::size_t kLanes = PointBatch::kLaneMultiple;
  const std::size_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  for (std::size_t i = count_; i < padded; ++i)
    x_[i] = y_[i] = 0.0;
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
  met_.resize(count_);
  return met_;
}

double
PatchRays::strayShare(const Patch& patch, const Pose& camera, double tolerance)
{
  meet(patch, camera);
  int seen = 0, stray = 0;
  for (std::size_t i = 0; i < met_.size(); ++i) {
    const bool sees = met_[i] > 0.0 && !std::isnan(measured_[i]);
    seen += sees;
    stray += sees && std::abs(measured_[i] - met_[i]) > tolerance;
  }
  return seen > 0 ? static_cast<double>(stray) / seen : 0.0;
}

} // namespace holdfast
