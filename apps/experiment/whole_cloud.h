/// \file Every patch of simulated frames about its noise-free fit, for `experiment
/// consistency`.
#pragma once

#include "experiment.h"
#include <holdfast/evaluation/consistency.h>
#include <holdfast/fit/options.h>
#include <holdfast/sensor/sensor.h>
#include <holdfast/uncertainty/covariance_mode.h>
#include <holdfast/validation/checks.h>

#include <map>
#include <vector>

namespace holdfast::app {

/// Of patches, of which some settle at another minimum than the noise-free points do,
/// hundreds of sigmas away, where a surface misfits: one of them would be the mean.
struct RobustTally {
  ErrorTally near; ///< up to ten sigmas off
  int far = 0;
};

/// What became of the accepted patches of one type.
struct CloudTally {
  /// Of the state, and of that without and with a flag.
  RobustTally state, unflagged_state, flagged_state;
  RobustTally surface; ///< of the normal and the height
  RobustTally parameters; ///< of patches without a flag whose axes did not switch
  int flagged = 0;
  int switched = 0; ///< without a flag, but turned by more than 45 degrees
  int other_type = 0; ///< that the noise-free points do not have; not judged
  int no_reference = 0; ///< whose noise-free points determine no patch; not judged
  long long points = 0; ///< of the patches judged
};

/// What became of the seeds of all frames at one radius, under one set of limits.
struct CloudCheck {
  double radius_m = 0.0;
  int frames = 0;
  int seeds = 0;
  int accepted = 0; ///< seeds with an accepted patch
  int over_edge = 0; ///< of the accepted patches leave the true surface
  int smooth_samples = 0; ///< of the true surface
  int covered_samples = 0; ///< of them lie on an accepted patch
  std::map<int, CloudTally> types; ///< by index in kPatchTypes
};

struct CloudCheckOptions {
  std::string scene; ///< of makeScene()
  FitOptions fit;
  CovarianceMode mode = CovarianceMode::Exact;
  /// What is accepted: each of these sees the same fits.
  std::vector<ValidationOptions> limits{ValidationOptions()};
  int frames = 10;
  std::uint64_t seed = 1;
  int threads = 0; ///< 0: all cores; the result does not depend on it
  Progress progress;
};

/// Frames of a scene from 1.0 to 1.2 m, from any side and 30 to 63 degrees above, with
/// noise and pattern of the sensor, go the road of `holdfast fit`. Each accepted patch
/// is compared with the fit to the same pixels without noise, under the covariances
/// that the noisy points have.
/// \return of the same frames, for each radius (metres) one check for each of the
/// limits.
std::vector<CloudCheck> checkClouds(const std::vector<double>& radii_m,
                                    const Sensor& sensor,
                                    const CloudCheckOptions& options);

void addTo(CloudCheck& all, const CloudCheck& one);

/// Of all types, without its name.
Json summaryOf(const CloudCheck& check);

/// A row for all types together and one for each there is.
std::vector<Json> rowsOf(const CloudCheck& check);

} // namespace holdfast::app
