/// \file What a fit returns.
#pragma once

#include <holdfast/fit/rare_matrix.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/patch/state.h>

#include <cstdint>
#include <string_view>

namespace holdfast {

/// The comment is the test itself.
enum class FitStatus : std::uint8_t {
  Converged, ///< last Newton step below the tolerance; patch valid
  AxisNotObservable, ///< no longer produced: FitFlags
  CurvatureNotObservable, ///< no longer produced: FitFlags
  IterationLimit, ///< max_iterations reached; patch is the best so far
  TooFewPoints, ///< fewer valid points than surface parameters
  Degenerate, ///< normal equations singular (see null_space); no extent; |kappa| of a
              ///< cylinder below a tenth of its sigma; a normal uncertain by more than
              ///< 1 rad; or a covariance whose terms cancelled down to rounding:
              ///< correlations with an eigenvalue below -1e-6
  CurvatureOutOfRange, ///< |kappa| > max_curvature_per_m
  CurvatureSignMismatch, ///< elliptic forced on opposite signs or hyperbolic on equal
  OrientationSingular, ///< |r_xy| = pi: no longer produced (r_xy keeps off the chart's
                       ///< singularity), kept for older files
  NonFinite ///< overflow: coordinates or covariances beyond all reason
};

/// "converged", "axis_not_observable", ... as in the program's JSON.
std::string_view statusName(FitStatus status);

/// True for the statuses that come with a patch and a covariance: finite, symmetric,
/// and positive semi-definite (no eigenvalue of its correlations below -1e-6).
bool isUsable(FitStatus status);

/// What the data do not tell of a patch that is otherwise all right. The state and its
/// covariance hold all the same; of the parameters' covariance, which is first order in
/// any case, the entries concerned mean nothing: observableCovariance() and files leave
/// them out.
struct FitFlags {
  /// The angle of the x axis is uncertain by more than 0.03 rad (second order: 0.10),
  /// since the curvatures, or the moments of a plane, are too close to each other: d, k
  /// and r are no linear functions of the points.
  bool axis_not_observable = false;
  /// |kappa| of a cylinder is below 20 of its sigmas (second order: 12) and d, k and r
  /// are no linear functions of the points, or that of a sphere below three; or the
  /// radius is more than 50 times the spread (root mean square; of a cylinder: across
  /// its axis) of the points.
  bool curvature_not_observable = false;
  /// r_xy of a round type is within ten sigmas of the normal from |r_xy| = pi, where a
  /// camera looks straight at the surface: r is no linear function of the points.
  bool orientation_singular = false;

  bool any() const
  {
    return axis_not_observable || curvature_not_observable || orientation_singular;
  }
};

/// Undetermined directions in the solver's parameters (fit/kernel.h), one unit
/// column each; rows are padded to six.
using NullSpace = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::DontAlign, 6, 6>;

struct FitResult {
  FitStatus status = FitStatus::TooFewPoints;
  /// Meaningful when isUsable(status), and the best so far at IterationLimit.
  Patch patch;
  /// The patch in regular coordinates (holdfast/patch/state.h), and their covariance;
  /// 0 x 0 when not usable.
  PatchState state;
  StateMatrix state_covariance;
  /// What of state_covariance errors make that points do not share: it averages over
  /// frames, while the rest, the pattern, does not as long as the camera stands still.
  /// 0 x 0 unless asked for (FitOptions::separate_pattern).
  RareMatrix<StateMatrix> white_state_covariance;
  /// Covariance of [d | k | r | c] (holdfast/patch/parameters.h); 0 x 0 when not
  /// usable. Where flags are set see observableCovariance().
  ParameterMatrix covariance;
  FitFlags flags;
  /// How far from linear the parameters are in the points: the share of second order in
  /// their covariance, trace(S1^-1 C2)/dof; computed in second order, else estimated
  /// from the sigma of the axis and the curvature in sigmas. First-order flags are set
  /// above 0.03.
  double nonlinearity = 0.0;
  /// By how much the mean of the estimate is off, to second order; empty unless the
  /// covariance was computed to second order. Not applied to the patch.
  RareMatrix<ParameterVector> mean_shift;
  RareMatrix<StateVector> state_mean_shift; ///< the same, of the state
  /// Sum of squared residuals over the point covariances, and its degrees of freedom
  /// (points minus surface parameters).
  double chi2 = 0.0;
  int chi2_dof = 0;
  /// What chi2 is on average where surface and noise are right: chi2_dof for
  /// independent errors; where points share errors, their number less what the surface
  /// takes up of them.
  double chi2_expected = 0.0;
  int points = 0; ///< points used
  int invalid_points = 0; ///< points left out: not finite or indefinite covariance
  /// Points left out because they cannot inform beside the others: the trace of their
  /// covariance is more than kUninformativeTraceRatio times the median
  /// (holdfast/fit/point_batch.h).
  int uninformative_points = 0;
  int iterations = 0; ///< damped Gauss-Newton steps tried
  int polish_steps = 0; ///< exact Newton steps at the end
  /// Directions the data do not determine; no column unless Degenerate, and none where
  /// the surface is determined, but not its bounds or its normal.
  RareMatrix<NullSpace> null_space;
};

/// The covariance of the parameters without the entries that the flags say nothing of:
/// they are NaN. 0 x 0 when not usable.
ParameterMatrix observableCovariance(const FitResult& fit);

/// How far the normal may be off: the rms angle between the fitted normal and that of
/// the points without noise, rad, from the covariance. NaN when not usable.
double normalSigma(const FitResult& fit);

/// How far the centre c may be off: the rms distance, m, from the covariance. NaN when
/// not usable.
double centreSigma(const FitResult& fit);

/// Standard deviation, m, of the centre along a direction in the frame of the patch's
/// coordinates: along the patch's normal, of the surface's height. NaN when not usable.
/// \param direction of any length but zero.
double centreSigma(const FitResult& fit, const Eigen::Vector3d& direction);

/// chi2 / chi2_expected: about 1 where surface and noise model are right. Zero without
/// degrees of freedom. Results without an expectation (from files of former versions):
/// over chi2_dof.
double chi2PerDof(const FitResult& fit);

} // namespace holdfast
