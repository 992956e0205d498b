/// \file One spot from many views, taken in by maps that know more or less of what
/// happens.
#pragma once

#include "spots.h"

#include <holdfast/fusion/patch_map.h>
#include <holdfast/noise_pattern.h>

#include <optional>
#include <random>
#include <string>
#include <vector>

namespace holdfast::app {

/// Where a map takes the pose of each view from.
enum class PoseSource : std::uint8_t {
  Known, ///< the true one
  Odometry, ///< increments that are off, robot-centric: PatchMap::move()
  OdometryTaken, ///< the same, as if they were exact
  OdometryWorld, ///< added up: PatchMap::place(), as if each were off on its own
  Still ///< the sensor does not move
};

/// A map and what it is told.
struct FusionRule {
  std::string name;
  PatchMapOptions map;
  PoseSource poses = PoseSource::Known;
  bool model_error = true; ///< what of the surface is no quadric counts
};

/// What is looked at, and by whom.
struct FusionCase {
  std::string part, name; ///< for the table
  double s3_per_m2 = 0.0; ///< of the surface
  double offset_m = 0.0; ///< of the supports' centres, at most
  NoisePattern pattern; ///< fixed; empty: errors are independent
  double odometry_sigma_rad = 0.0, odometry_sigma_m = 0.0; ///< per increment and axis
  std::vector<int> views; ///< after which the map is looked at
  std::vector<FusionRule> rules; ///< which all see the same
};

/// A map after some views, against the best quadric over its patch's own disc.
struct SpotError {
  double squared_in_sigmas = 0.0; ///< of all six numbers
  double height_variance_m2 = 0.0;
};

/// Of one rule.
struct RuleOutcome {
  /// By FusionCase::views; nothing where there is no patch or no truth.
  std::vector<std::optional<SpotError>> errors;
  int measured = 0, refused = 0; ///< measurements; by the gate
};

/// One trial, by FusionCase::rules.
std::vector<RuleOutcome> fuseViews(const FusionCase& c, std::mt19937_64& generator);

} // namespace holdfast::app
