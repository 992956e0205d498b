/// \file Walks through simulated scenes with maps of patches, and how far these are
/// from the truth.
#pragma once

#include "spots.h"

#include <holdfast/fusion/patch_map.h>
#include <holdfast/progress.h>
#include <holdfast/sensor/sensor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

enum class WalkPoses : std::uint8_t {
  Known, ///< true ones
  Odometry, ///< increments with errors of known size
  Registration ///< found from the patches alone
};

/// A map, and what it has to do with.
struct WalkRule {
  std::string name;
  WalkPoses poses;
  bool pattern; ///< errors that pixels share, the same in every frame
};

struct WalkSettings {
  std::string scene;
  int frames = 101;
  double step_m = 0.1;
  int stride = 2; ///< of pixels
  Sensor sensor; ///< with its pattern
  double odometry_sigma_rad = 1e-3, odometry_sigma_m = 2e-3; ///< per frame and axis
  std::uint64_t seed = 1;
  int threads = 0;
  Progress progress;
};

/// A patch of the map as it was when it was last seen, against the best quadric of the
/// scene over its disc where it lies from the true sensor.
struct MapPatchError {
  int views = 0;
  double height_sigma_m = 0.0;
  double first_height_sigma_m = 0.0; ///< after its first view
  double slope_sigma = 0.0; ///< the larger one
  /// What of the true surface is no quadric, root mean square; nothing: there is no
  /// surface below a part of it.
  std::optional<double> residual_m;
  /// Squared, in sigmas: of the height, the slopes, the curvatures, all six.
  double height = 0.0, normal = 0.0, curvature = 0.0, all = 0.0;
};

/// What a frame did.
struct WalkFrame {
  double way_m = 0.0; ///< so far
  double position_error_m = 0.0; ///< of the sensor
  double rotation_error_rad = 0.0;
  bool is_lost = false; ///< registration failed
  bool is_open = false; ///< or left a direction to the prior
  /// Of the increment found by registration: squares, means of three axes, and what it
  /// speaks of in sigmas.
  std::optional<double> squared_rad, squared_m;
  std::optional<ObservedError> observed;
  UpdateReport update;
  double milliseconds = 0.0;
  std::optional<double> update_milliseconds; ///< of the map's part; of some frames
};

struct WalkOutcome {
  std::vector<MapPatchError> patches;
  std::vector<WalkFrame> frames;
  /// Why the map took no further frame; empty: it took them all.
  std::string failure;
};

/// Walks once; all rules see the same scene from the same poses, and those without
/// pattern the same noise. The same for any number of threads but for the times.
/// \return by rule.
std::vector<WalkOutcome> walkThrough(const WalkSettings& settings,
                                     const std::vector<WalkRule>& rules);

} // namespace holdfast::app
