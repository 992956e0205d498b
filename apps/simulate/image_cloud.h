/// \file Simulated images as the clouds a camera delivers.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/simulation/simulator.h>

namespace holdfast::app {

/// Whether there is a measured point in it.
bool seesAnything(const RangeImage& image);

/// The measured points as an organized cloud, with the errors of the sensor's pattern
/// map if it has one.
/// \param noise_scale as the image has it
RangeCloud cloudOf(const RangeImage& image,
                   const Sensor& sensor,
                   double noise_scale,
                   bool with_covariances);

} // namespace holdfast::app
