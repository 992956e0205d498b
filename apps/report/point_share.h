/// \file The points of a cloud that a page shows, and how light they are.
#pragma once

#include "result_input.h"

#include <cstdint>
#include <vector>

namespace holdfast::app {

/// Some points of a cloud.
struct PointShare {
  std::vector<Eigen::Vector3d> positions; ///< world frame, m
  /// Red, green, blue of each point where the cloud has colours, else one gray each: as
  /// its surface looks under a lamp above the sensor's left shoulder.
  std::vector<std::uint8_t> colors;
  double spacing = 0.0; ///< between neighbours, m: the median
};

/// `count` points without a pattern, the same ones every time, or all there are.
PointShare shareOf(const SeenCloud& cloud, std::size_t count);

} // namespace holdfast::app
