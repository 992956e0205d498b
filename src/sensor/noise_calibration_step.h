/// \file The step in which a sensor reports its disparities.
#pragma once

#include "noise_calibration_regions.h"

namespace holdfast {

/// Its size in px of disparity; NaN when there is none, or when it is no wider than the
/// rounding of the depths in the file.
Estimate findQuantum(const DisparityStack& stack,
                     const TileImage& image,
                     const std::vector<Region>& regions,
                     const std::vector<int>& cells,
                     double focal_times_baseline);

} // namespace holdfast
