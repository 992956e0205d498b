/// \file Polygons in a plane, as their corners one after the other.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace holdfast {

/// By the number of edges that a ray along x crosses; convex or not.
inline bool
isInside(const std::vector<Eigen::Vector2d>& corners, const Eigen::Vector2d& p)
{
  bool inside = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Eigen::Vector2d &a = corners[i], &b = corners[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()))
      inside = !inside;
  }
  return inside;
}

} // namespace holdfast
