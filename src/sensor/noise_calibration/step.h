/// \file The step in which a sensor reports its disparities.
#pragma once

#include "regions.h"

namespace holdfast {

/// Its size in px of disparity; NaN when there is none, or none that shows: finer than
/// a quarter of the noise, or than the rounding of the depths in the file.
Estimate findQuantum(const DisparityStack& stack,
                     const TileImage& image,
                     const std::vector<Region>& regions,
                     double focal_times_baseline);

} // namespace holdfast
