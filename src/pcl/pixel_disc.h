/// \file The pixels of one surface within a disc around a seed.
#pragma once

#include "pixel_grid.h"
#include "pixel_runs.h"

#include <algorithm>
#include <vector>

namespace holdfast {

/// How much the depths of neighbouring pixels of one surface may differ around a seed.
struct JumpLimit {
  float noise; ///< m
  double slope_m; ///< m per unit of x/z or y/z

  float along(double slope_difference) const
  {
    return std::max(noise, static_cast<float>(slope_m * slope_difference));
  }
};

/// Replaces `indices` by the pixels within the image of `radius_m` at the depth of the
/// seed that are connected to it (4-neighbours, depths within the limit), ascending.
/// \param seed index of a valid pixel.
/// \param runs working memory.
void connectedDisc(const PixelGrid& grid,
                   int seed,
                   double radius_m,
                   const JumpLimit& limit,
                   RunMemory& runs,
                   std::vector<int>& indices);

} // namespace holdfast
