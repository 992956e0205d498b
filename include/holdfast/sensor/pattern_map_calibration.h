/// \file The map of a camera's fixed pattern, from planes it saw from several places.
#pragma once

#include <holdfast/sensor/pattern_calibration.h>
#include <holdfast/sensor/pattern_map.h>

#include <memory>
#include <vector>

namespace holdfast {

/// What the map is worth is told on each pose with the map of all others: no frame is
/// judged by a map that it helped to make.
struct PatternMapCalibration {
  NoiseCalibrationStatus status = NoiseCalibrationStatus::NothingStatic;
  int pose = 0; ///< of which the status speaks
  /// From all poses; null unless Ok, and where no pixel saw planes from two poses.
  std::shared_ptr<const PatternMap> map;
  double smoothing_px = 0.0; ///< sigma of the Gaussian; 0: none
  /// A mean over n poses counts by n / (n + shrinkage).
  double shrinkage = 0.0;
  double known_part = 0.0; ///< of all pixels
  /// Rms over the pixels that two poses or more saw on planes, of what these planes
  /// leave of the mean disparity, px.
  double before_px = 0.0;
  double after_px = 0.0; ///< the same less the map of the other poses
  /// What calibratePattern() finds in each pose less the map of the others: the pattern
  /// that is left in a frame the map has not seen. Without what poses share, since each
  /// is a part of the maps that the others were judged by.
  PatternCalibration left;
};

/// Robust smoothed mean over the poses of what least-squares planes leave of the
/// disparities in each pixel, pulled towards zero the more the fewer poses saw it. How
/// much is smoothed and pulled is what leaves least in the pose that is left out. Only
/// planes count.
///
/// \param poses two or more, with the pixels of all at the same places of the sensor.
/// \throw std::invalid_argument as calibratePattern(), and for a single pose.
PatternMapCalibration calibratePatternMap(const std::vector<PoseFrames>& poses,
                                          const NoiseCalibrationOptions& options);

} // namespace holdfast
