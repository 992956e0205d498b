/// \file The points of a neighbourhood in the local frame of a patch.
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/geometry/pose.h>

#include <cstddef>
#include <type_traits>
#include <vector>

namespace holdfast {

/// visit(local), or visit(local, i) where that is what it takes.
template <typename Visit>
void
visitLocal(Visit& visit, const Eigen::Vector3d& local, std::size_t i)
{
  if constexpr (std::is_invocable_v<Visit&, const Eigen::Vector3d&, std::size_t>)
    visit(local, i);
  else
    visit(local);
}

/// Calls visit(local), or visit(local, i), for every finite point i.
template <typename Visit>
void
forEachLocal(const Pose& pose, const PointBatch& points, Visit&& visit)
{
  // A sum of columns compiles to a third of the time of Pose::toLocal(). The origins
  // are subtracted first, so that patches far from zero lose no precision.
  const Eigen::Matrix3d axes = pose.R.transpose();
  const Eigen::Vector3d shift = axes * (points.origin() - pose.c);
  const double* x = points.channel(PointBatch::X);
  const double* y = points.channel(PointBatch::Y);
  const double* z = points.channel(PointBatch::Z);
  for (int i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d local =
        axes.col(0) * x[i] + axes.col(1) * y[i] + axes.col(2) * z[i] + shift;
    if (local.allFinite())
      visitLocal(visit, local, static_cast<std::size_t>(i));
  }
}

template <typename Visit>
void
forEachLocal(const Pose& pose,
             const std::vector<Eigen::Vector3d>& points,
             Visit&& visit)
{
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d local = pose.toLocal(points[i]);
    if (local.allFinite())
      visitLocal(visit, local, i);
  }
}

} // namespace holdfast
