/// \file The one call that turns points into a patch with its covariance.
#pragma once

#include <holdfast/fit/fit_patch.h>
#include <holdfast/fit/result.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace holdfast {

/// How the covariance of the estimate is computed.
enum class CovarianceMode : std::uint8_t {
  /// First order through every stage, with the full Hessian of the cost (default).
  Exact,
  /// As Exact, with J^T J in place of the Hessian.
  GaussNewton,
  /// Exact, plus the second-order terms of the stages after the fit, with the shift of
  /// the mean (holdfast/uncertainty/second_order.h). For few points and strong noise.
  SecondOrder,
  /// The paper's chain with its independence assumptions, to compare
  /// (holdfast/uncertainty/stagewise.h).
  Stagewise,
  /// Resample and refit, 1000 times: the referee
  /// (holdfast/uncertainty/monte_carlo.h).
  MonteCarlo
};

/// Every mode, in the order of the enumeration.
inline constexpr std::array kAllCovarianceModes{CovarianceMode::Exact,
                                                CovarianceMode::GaussNewton,
                                                CovarianceMode::SecondOrder,
                                                CovarianceMode::Stagewise,
                                                CovarianceMode::MonteCarlo};

/// "exact", "gauss_newton", ... as in the program's JSON.
std::string_view covarianceModeName(CovarianceMode mode);

/// Covariance of a fitted patch's parameters [d | k | r | c].
struct PatchCovariance {
  ParameterMatrix covariance; ///< 0 x 0 when there is none
  ParameterVector mean_shift; ///< SecondOrder only, else empty
};

/// The estimate is a function of the points, so to first order
/// Sigma = sum_i G_i Sigma_i G_i^T with G_i = d(estimate)/dq_i through every stage:
/// scatter and its normal, the weighted fit, the frame and the bounds. It holds for the
/// noise of the points alone (not for a surface that is not of the fitted type),
/// independent between points, given the points that were sampled, and in the frame of
/// the points. It is singular where the parameters are bound to each other: the quad's
/// four radii are equal, so its rank is 8.
///
/// \param batch the points as PatchFitter::fit() left them.
/// \return empty unless fit.status is FitStatus::Converged.
PatchCovariance patchCovariance(const PatchFit& fit,
                                const PointBatch& batch,
                                const PatchFitter& fitter,
                                CovarianceMode mode);

/// Fits patches with covariance under one set of options; see PatchFitter.
class PatchEstimator {
public:
  /// \throw std::invalid_argument when the options make no sense (validityError).
  explicit PatchEstimator(const FitOptions& options,
                          CovarianceMode mode = CovarianceMode::Exact);

  /// Fits a patch and attaches the covariance of its parameters. Bad data never throw:
  /// they come back as a status.
  /// \param batch is cleaned of invalid points, given its sigma floor, and padded.
  FitResult estimate(PointBatch& batch) const;

private:
  PatchFitter fitter_;
  CovarianceMode mode_;
};

/// One patch, for callers who have just one: PatchEstimator(options,
/// mode).estimate(batch).
FitResult estimatePatch(PointBatch& batch,
                        const FitOptions& options,
                        CovarianceMode mode = CovarianceMode::Exact);

} // namespace holdfast
