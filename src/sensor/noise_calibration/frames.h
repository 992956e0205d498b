/// \file What all calibrations ask of their frames.
#pragma once

#include <holdfast/sensor/noise_calibration.h>

#include <vector>

namespace holdfast {

/// \throw std::invalid_argument when there is no frame, their sizes differ, or one has
/// another number of points.
void requireSameSizes(const std::vector<PointImage>& frames);

} // namespace holdfast
