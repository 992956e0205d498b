/// \file What a noise calibration found, in the forms people and programs want.
#pragma once

#include "plot.h"

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/noise_calibration.h>
#include <holdfast/sensor/pattern_calibration.h>
#include <holdfast/sensor/pattern_map_calibration.h>
#include <holdfast/sensor/sensor.h>

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace holdfast::app {

struct NoiseReport {
  NoiseCalibration found; ///< in the first pose
  /// In all; not Ok where the first has only small spots. With a map, of what is left.
  PatternCalibration pattern;
  PatternMapCalibration map; ///< without a map: not asked for
  Sensor sensor; ///< the one assumed, with the camera of the frames

  bool hasMap() const
  {
    return map.map != nullptr;
  }

  /// Whether neighbouring pixels share anything.
  bool hasPattern() const
  {
    return !pattern.waves.empty();
  }
};

/// Measures the noise in organized clouds of resting scenes, one or more frames of
/// each. \param sensor nominal; its camera should be that of the clouds
/// (matchedSensor). \param poseName the frames of a pose in a message. \throw
/// std::runtime_error when a scene holds nothing that rests and is flat. \throw
/// std::invalid_argument when their sizes differ, or there is none.
NoiseReport measureNoise(const std::vector<std::vector<RangeCloud>>& poses,
                         const Sensor& sensor,
                         int region_px,
                         const std::function<std::string(int pose)>& poseName);

/// Makes a pattern map from two or more poses, too, and measures the pattern that is
/// left without it. \throw std::runtime_error when no pixel saw planes from two.
void measurePatternMap(const std::vector<std::vector<RangeCloud>>& poses,
                       NoiseReport& report);

/// Tables and what they mean.
std::string noiseReportText(const NoiseReport& report);

/// All numbers; unknown ones are null.
nlohmann::ordered_json noiseReportJson(const NoiseReport& report);

/// Sigmas of disparity and depth over the depth, with the model's curves, and what
/// neighbouring pixels share over their distance.
Plot noiseReportPlot(const NoiseReport& report);

/// A sensor file with the measured noise and where each figure came from. The sensor is
/// named after the file.
/// \param map_path of the report's pattern map, written before; empty without.
void saveCalibratedSensor(const std::string& path,
                          const NoiseReport& report,
                          const std::string& map_path);

} // namespace holdfast::app
