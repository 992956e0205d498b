/// \file Where a frame was taken, from its patches and those of a map.
#pragma once

#include <holdfast/fusion/patch_map.h>

#include <vector>

namespace holdfast {

struct RegistrationOptions {
  int max_iterations = 20;
  /// In the first iteration a measurement looks this many radii of the map for its
  /// patch, in each of the next half as far as before, until that is as far as the map
  /// associates: how far off the guess may be.
  double first_reach = 4.0;
  /// As long, a pair counts less beyond this many sigmas of its own (Huber, on the
  /// Mahalanobis distance of its six numbers); then the map's gate decides whether it
  /// counts.
  double robust_distance = 4.0;
  /// Iterations stop when a step is no longer than this many sigmas: with a thirtieth
  /// the error grows by a thousandth, and pairs that come and go at the gate do not
  /// keep them going.
  double step_tolerance_sigma = 0.03;
  /// Directions of the pose (scaled to the sensor's distance from the patches) whose
  /// information is below this share of the largest, or below three times what errors
  /// of slopes alone would seem to tell, are not observable: flat ground tells nothing
  /// of x, y and yaw. They stay as the guess has them.
  double smallest_information = 1e-4;
  int min_pairs = 6;
};

enum class RegistrationStatus : std::uint8_t {
  Converged,
  IterationLimit,
  TooFewPairs, ///< the pose is the guess
  NotObservable ///< in no direction at all; the pose is the guess
};

struct RegistrationResult {
  RegistrationStatus status = RegistrationStatus::TooFewPairs;
  Pose pose; ///< of the sensor, frame of the map
  /// Of (delta, c), R <- R Exp(delta), c in the axes of the map, rad and m: of what the
  /// data tell, zero along the null space. Of the pattern, patches of the frame that
  /// are near each other in the view share the error; those of the map count as if they
  /// shared none.
  JetMatrix covariance = JetMatrix::Zero();
  /// Unit directions of (delta, c) that the data do not determine, one column each.
  Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> null_space{6, 0};
  int iterations = 0;
  int pairs = 0; ///< measurements that counted in the end
  int gated = 0; ///< measurements with a patch near that the gate refused
  /// Without a patch near, or whose patch another one matched better.
  int unmatched = 0;
  /// Sum of the squared Mahalanobis distances of the pairs; six for each on average.
  double chi2 = 0.0;
};

/// The pose of the sensor at which its measurements fit the map best, from a guess that
/// is off by no more than options.first_reach at the patches. Every patch of the map is
/// used once.
RegistrationResult registerPatches(const std::vector<Measurement>& measurements,
                                   const PatchMap& map,
                                   const Pose& guess,
                                   const RegistrationOptions& options = {});

} // namespace holdfast
