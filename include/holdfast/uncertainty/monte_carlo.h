/// \file The referee of the covariance modes: resample the points and fit again.
#pragma once

#include <holdfast/fit/options.h>
#include <holdfast/fit/point_batch.h>
#include <holdfast/patch/state.h>
#include <holdfast/progress.h>

#include <cstdint>
#include <random>
#include <vector>

namespace holdfast {

struct MonteCarloOptions {
  int trials = 1000;
  std::uint64_t seed = 1;
  int threads = 0; ///< 0: all cores; the result does not depend on it
  Progress progress;
};

struct MonteCarloResult {
  /// Parameters [d | k | r | c] of the fits that converged, in the order of the trials,
  /// each in the representation nearest to the reference (nearestRepresentation).
  std::vector<ParameterVector> samples;
  int failures = 0; ///< trials that did not converge
  /// Over the samples; empty with fewer than two.
  ParameterVector mean;
  ParameterMatrix covariance; ///< unbiased, over n - 1
  /// The same of their states, each as its difference from the reference's
  /// (holdfast/patch/state.h).
  std::vector<StateVector> states;
  StateVector state_mean;
  StateMatrix state_covariance;
};

/// Spread of the estimate when the noise is drawn again: every trial adds noise
/// N(0, Sigma_i) to the given points, correlated where the batch has a pattern (over
/// all pairs of points), keeps the Sigma_i, and fits a patch of the reference's type.
///
/// Drawn about noise-free points this is the truth that the other modes are judged by;
/// about measured points it is the parametric bootstrap.
/// \param reference a fit to these points; gives the type and the representation.
/// \param batch points and covariances; invalid ones are left out. Not changed.
/// \throw std::invalid_argument for fewer than one trial or options that make no sense.
MonteCarloResult monteCarloCovariance(const Patch& reference,
                                      const PointBatch& batch,
                                      const FitOptions& options,
                                      const MonteCarloOptions& monte_carlo);

/// The generator of one trial: trials are independent of each other and of the thread
/// that makes them.
std::mt19937_64 trialGenerator(std::uint64_t seed, std::uint64_t trial);

} // namespace holdfast
