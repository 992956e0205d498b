#include "patch_support.h"

#include <holdfast/patch/surface.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace holdfast::app {
namespace {

bool
isLeft(const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  return a.x() < b.x();
}

} // namespace

SupportedCells::SupportedCells(const std::vector<Eigen::Vector3d>& points,
                               double half_side)
: half_side_(half_side)
{
  constexpr double kPointsPerCell = 4.0;
  constexpr int kMostCells = 12; // to a side
  const double count = static_cast<double>(points.size());
  side_ =
      std::clamp(static_cast<int>(std::sqrt(count / kPointsPerCell)), 1, kMostCells);
  is_supported_.resize(static_cast<std::size_t>(side_) *
                       static_cast<std::size_t>(side_));
  for (const Eigen::Vector3d& point : points)
    is_supported_[static_cast<std::size_t>(cellOf(point.y()) * side_ +
                                           cellOf(point.x()))] = true;
}

int
SupportedCells::cellOf(double coordinate) const
{
  const double cell = (coordinate + half_side_) / (2.0 * half_side_) * side_;
  return std::clamp(static_cast<int>(cell), 0, side_ - 1);
}

bool
SupportedCells::contains(const Eigen::Vector2d& xy) const
{
  return side_ == 0 || is_supported_[static_cast<std::size_t>(cellOf(xy.y()) * side_ +
                                                              cellOf(xy.x()))];
}

PatchSupport::PatchSupport(std::vector<Eigen::Vector3d> points)
: points_(std::move(points))
{
  std::sort(points_.begin(), points_.end(), isLeft);
}

SupportedCells
PatchSupport::of(const Patch& patch) const
{
  const Pose pose = patch.pose();
  const double half_side = patch.d.head<4>().maxCoeff();
  const double reach = 2.0 * half_side; // a corner, as high as it may be
  const Eigen::Vector3d low = pose.c.array() - reach, high = pose.c.array() + reach;
  std::vector<Eigen::Vector3d> near;
  const auto end = std::upper_bound(points_.begin(), points_.end(), high, isLeft);
  for (auto at = std::lower_bound(points_.begin(), points_.end(), low, isLeft);
       at != end;
       ++at) {
    if ((*at - pose.c).tail<2>().cwiseAbs().maxCoeff() > reach)
      continue; // most of them
    const Eigen::Vector3d q = pose.toLocal(*at);
    if (q.head<2>().cwiseAbs().maxCoeff() > half_side)
      continue;
    const auto z = height(patch, q.x(), q.y());
    if (z && std::abs(q.z() - *z) <= 0.5 * half_side)
      near.push_back(q);
  }
  return {near, half_side};
}

} // namespace holdfast::app
