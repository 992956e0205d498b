/// \file What is doubtful about a sample consensus before it begins, and why it found
/// nothing: PCL's habits (metres, 0.01) meet thresholds in sigmas here.
#pragma once

#include <holdfast/pcl/consensus_options.h>
#include <holdfast/pcl/impl/sac_engine.h>

#include "cloud_measure.h"

#include <string>
#include <vector>

namespace holdfast {

struct ConsensusFacts {
  CloudMeasure cloud;
  ConsensusLimits limits;
  /// What threshold and distances are in.
  ConsensusDistance unit = ConsensusDistance::Mahalanobis;
  /// Metres were not asked for, but there is no noise to measure sigmas by.
  bool for_want_of_noise = false;
  /// Covariances or a noise model were given.
  bool noise_known = false;
  /// Median over the points of the sigma in the direction where it is largest, m; NaN
  /// where nothing is known or no point has a usable covariance.
  double noise_m = 0.0;
  bool curved = false; ///< the surface has a radius
};

/// One line each: what was given, what was expected, the likely cause. Empty where all
/// orders of magnitude fit together.
std::vector<std::string> doubtsAbout(const ConsensusFacts& facts);

/// One line for a search without result: all of the above side by side and the likely
/// cause.
std::string whyNothing(const ConsensusFacts& facts);

} // namespace holdfast
