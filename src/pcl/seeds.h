/// \file The four ways to choose seeds; see SeedStrategy.
#pragma once

#include "pixel_grid.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdint>
#include <vector>

namespace holdfast {

// In all of these `valid` holds the indices of the valid points, ascending, and
// `max_seeds` = 0 means no limit.

/// Pixels one spacing apart in space, near and far alike, as densely as that allows.
std::vector<int> pixelGridSeeds(const PixelGrid& grid, double spacing_m, int max_seeds);

/// In each occupied voxel of side `spacing_m` the point nearest its centre.
std::vector<int> voxelGridSeeds(const pcl::PointCloud<pcl::PointXYZ>& points,
                                const std::vector<int>& valid,
                                double spacing_m,
                                int max_seeds);

/// `count` of the valid points (all, if fewer), each subset and order equally likely.
std::vector<int> randomSeeds(std::vector<int> valid,
                             std::size_t count,
                             std::uint64_t random_seed);

/// Valid points in random order, each kept unless one kept before is nearer than
/// `spacing_m`.
std::vector<int> poissonSeeds(const pcl::PointCloud<pcl::PointXYZ>& points,
                              std::vector<int> valid,
                              double spacing_m,
                              int max_seeds,
                              std::uint64_t random_seed);

} // namespace holdfast
