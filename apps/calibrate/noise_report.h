/// \file What a noise calibration found, in the forms people and programs want.
#pragma once

#include "plot.h"

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/noise_calibration.h>
#include <holdfast/sensor/sensor.h>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace holdfast::app {

struct NoiseReport {
  NoiseCalibration found;
  Sensor sensor; ///< the one assumed, with the camera of the frames
};

/// Measures the noise in organized clouds of one resting scene.
/// \param sensor nominal; its camera should be that of the clouds (matchedSensor).
/// \throw std::runtime_error when the clouds hold nothing that rests and is flat.
/// \throw std::invalid_argument when their sizes differ, or there is none.
NoiseReport measureNoise(const std::vector<RangeCloud>& clouds,
                         const Sensor& sensor,
                         int region_px);

/// Tables and what they mean.
std::string noiseReportText(const NoiseReport& report);

/// All numbers; unknown ones are null.
nlohmann::ordered_json noiseReportJson(const NoiseReport& report);

/// Sigmas of disparity and depth over the depth, with the model's curves.
Plot noiseReportPlot(const NoiseReport& report);

/// A sensor file with the measured noise and where each figure came from. The sensor is
/// named after the file.
void saveCalibratedSensor(const std::string& path, const NoiseReport& report);

} // namespace holdfast::app
