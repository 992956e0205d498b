/// \file Are the covariances right? Monte Carlo over noise drawn on a known scene.
#pragma once

#include <holdfast/patch_estimator.h>
#include <holdfast/progress.h>
#include <holdfast/simulation/simulator.h>

#include <cstdint>
#include <vector>

namespace holdfast {

/// How the errors of several fits compare with their covariances.
struct ErrorTally {
  int count = 0;
  double nees_per_dof = 0.0; ///< mean normalised squared error over its rank
  double coverage95 = 0.0; ///< share within the 95 % ellipsoid
};

/// Of parts of the state, each alone. Where neighbours share errors and points are
/// many, what is a point's own averages away, and the parts move together, along a line
/// that bends: each can be right and the whole too sure.
struct StateTallies {
  ErrorTally moments, curvature, normal, centre;
  ErrorTally surface; ///< the normal, and the height of the centre along it
};

/// Trials by a number that their fits report.
struct ConsistencyColumn {
  double up_to = 0.0; ///< largest such number; the last column has no end
  ErrorTally state;
  ErrorTally parameters; ///< axes that switched left out
};

struct ConsistencyOptions {
  FitOptions fit; ///< surface and boundary are set to the type of the scene's patch
  CovarianceMode mode = CovarianceMode::Exact;
  int trials = 3000;
  std::uint64_t seed = 1;
  int threads = 0; ///< 0: all cores; the result does not depend on it
  double noise_scale = 1.0; ///< factor on the sigmas of the noise drawn and assumed
  /// Refit every trial with SurfaceRequest::Auto to count type errors.
  bool count_type_errors = false;
  Progress progress;
};

/// How predicted covariances compare with what happened. All errors are in the tangent
/// space [d | k | delta | c] about the fit to noise-free points: the patch that the
/// same pixels give without noise, not the patch the scene was made of.
struct ConsistencyResult {
  int trials = 0;
  int points = 0;
  /// Normalised estimation error squared over the rank of the covariance: 1 is right.
  /// About the noise-free fit; SecondOrder's region lies about the estimate plus its
  /// mean shift (the estimate minus the shift is unbiased, but seen from the estimate
  /// what it came from lies the other way, as on a bent line).
  double nees_per_dof = 0.0;
  double nees_per_dof_about_mean = 0.0;
  /// Share of the trials within the 95 % ellipsoid about the noise-free fit.
  double coverage95 = 0.0;
  /// By parameter: root mean predicted variance over empirical sigma.
  std::vector<double> sigma_ratio;
  /// By parameter: mean error over empirical sigma.
  std::vector<double> bias_sigma;
  /// As bias_sigma after subtracting the second-order shift at the noise-free fit.
  std::vector<double> bias_after_shift_sigma;
  /// Of the state (holdfast/patch/state.h), over all usable trials, as nees_per_dof and
  /// coverage95, which are those of the parameters.
  double state_nees_per_dof = 0.0;
  double state_coverage95 = 0.0;
  /// Of the parameters of trials without a flag (FitResult::flags), and the share of
  /// those in the usable trials.
  double unflagged_nees_per_dof = 0.0;
  double unflagged_rate = 0.0;
  /// Of the state, without and with a flag.
  ErrorTally unflagged_state, flagged_state;
  StateTallies parts; ///< of the state, over all usable trials
  /// By FitResult::nonlinearity: the sigma of the axis or of the curvature, rescaled.
  std::vector<ConsistencyColumn> by_nonlinearity;
  /// By |kappa| in sigmas; empty where a type has none, or two.
  std::vector<ConsistencyColumn> by_curvature;
  double type_error_rate = 0.0;
  /// Trials whose axes came out turned by more than 45 degrees; left out above.
  double switch_rate = 0.0;
  /// Trials without a usable fit; left out above.
  double failure_rate = 0.0;
};

/// All trials of several checks of one type together: means weighted with their trials;
/// biases and ratios of sigmas, which belong to one scene, are left out.
ConsistencyResult pooled(const std::vector<ConsistencyResult>& results);

/// \param scene its first patch is fitted; points on anything else are not used.
/// \param sensor noise is drawn from its model and its pattern, if it has one, and the
/// covariances are taken from them; of its camera only what the pattern needs is used:
/// which pixels the rays meet.
/// \throw std::invalid_argument when options make no sense, the scene has no patch, the
///        noise-free points do not determine it, or there is a pattern and the rays do
///        not lie on rows and columns of the camera.
ConsistencyResult checkConsistency(const Scene& scene,
                                   const RayGrid& rays,
                                   const Sensor& sensor,
                                   const ConsistencyOptions& options);

/// The same for independent errors of a noise model, which must outlive the call.
ConsistencyResult checkConsistency(const Scene& scene,
                                   const RayGrid& rays,
                                   const NoiseModel& noise,
                                   const ConsistencyOptions& options);

} // namespace holdfast
