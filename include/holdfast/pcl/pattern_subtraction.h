/// \file Clouds without what a camera's pattern map says of their errors.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <string>

namespace holdfast {

/// The cloud with the errors of the sensor's pattern map subtracted from the
/// disparities of its points, which move along their rays; the cloud itself where the
/// sensor has no map. An organized cloud is that of the map's pixels; a point of any
/// other has the pixel in which the sensor's camera sees it, if there is one.
///
/// To be done once, before anything else: what the sensor's pattern describes is left
/// after it.
///
/// \param notice if not null: receives one line where the map is not subtracted, since
/// the cloud has covariances of its own or lies outside the camera's view.
/// \throw std::runtime_error with patternMapError() of an organized cloud, and when the
/// sensor's noise model is not "stereo".
RangeCloud subtractPatternMap(const RangeCloud& cloud,
                              const Sensor& sensor,
                              std::string* notice = nullptr);

/// Empty when the sensor has no map or one of this size, else what is wrong.
std::string patternMapError(const Sensor& sensor, int width, int height);

} // namespace holdfast
