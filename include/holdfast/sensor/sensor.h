/// \file A depth sensor: its camera and the noise of its measurements.
#pragma once

#include <holdfast/noise_pattern.h>
#include <holdfast/sensor/camera.h>
#include <holdfast/sensor/noise_model.h>
#include <holdfast/sensor/pattern_map.h>

#include <memory>
#include <string>

namespace holdfast {

struct Sensor {
  std::string name;
  Camera camera;
  NoiseModel::ConstPtr noise; ///< never null in a loaded sensor
  /// The part of that noise which neighbouring pixels share.
  NoisePattern pattern;
  /// What is to be subtracted from its disparities before all that
  /// (subtractPatternMap), with the noise model "stereo" only; null: nothing.
  std::shared_ptr<const PatternMap> pattern_map;
  /// Depth range the sensor delivers, m.
  double min_range_m = 0.0;
  double max_range_m = 1e3;
  /// Step of the disparity the sensor quantises to, px; 0: not quantised.
  double disparity_quantum_px = 0.0;
  /// Stereo geometry behind the disparity, needed for quantisation: baseline in metres
  /// and focal length in px of the disparity image.
  double baseline_m = 0.075;
  double disparity_focal_px = 580.0;
};

/// The sensor with the camera that a cloud was taken with. The lengths of the pattern
/// follow its pixels: those of an image of half the width, of the same view, are twice
/// as large.
Sensor withCamera(Sensor sensor, const Camera& camera);

/// The sensor without its pattern: errors of neighbouring pixels count as independent,
/// and no map of them is subtracted.
Sensor withoutPattern(Sensor sensor);

/// The sensor with the same noise for every point in every direction, without pattern
/// or map, and a name that says so: for clouds that the sensor's model does not
/// describe.
Sensor withConstantNoise(Sensor sensor, double sigma_m);

} // namespace holdfast
