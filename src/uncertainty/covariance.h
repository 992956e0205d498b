/// \file From a fit to the covariance of its parameters.
#pragma once

#include "fit/fit_patch.h"

#include <holdfast/uncertainty/covariance_mode.h>

#include <limits>

namespace holdfast {

/// Covariance of a fitted patch's state [M | k | nu | c] and of its parameters
/// [d | k | r | c].
struct PatchCovariance {
  StateMatrix state; ///< 0 x 0 when there is none
  StateMatrix white_state; ///< 0 x 0 when not asked for: FitOptions::separate_pattern
  ParameterMatrix parameters; ///< 0 x 0 when there is none
  StateVector state_shift; ///< likewise
  ParameterVector shift; ///< where second order was added, else empty
  /// By how much the terms of a variance of the state may exceed it, where points share
  /// errors: what moves all points alike moves a patch, but does not bend it.
  double cancellation = 1.0;
  /// trace(S1^-1 C2)/dof of the parameters, C2 the second-order terms and S1 what the
  /// rest is; NaN where second order was not added.
  double nonlinearity = std::numeric_limits<double>::quiet_NaN();
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

/// The mean of chi2 where surface and noise are right: E[chi2] is that of the errors,
/// one a point, less tr(H^-1 Cov(E_theta)), what the surface takes up of them. Of
/// independent errors that is the number of its parameters, of shared ones more.
double expectedChi2(const PatchFit& fit);

/// Converged; Degenerate or NonFinite where the state's covariance is none.
FitStatus statusOf(const Patch& patch, const PatchCovariance& uncertainty);

/// How far from linear the parameters are in the points, and what of them is therefore
/// not known (FitFlags).
struct Linearity {
  double nonlinearity = 0.0; ///< as FitResult::nonlinearity
  FitFlags flags;
};

Linearity linearityOf(const PatchFit& fit, const PatchCovariance& uncertainty);

/// The same of a patch whose points are not there to say how far away its centre is.
Linearity linearityOf(const Patch& patch, const PatchCovariance& uncertainty);

} // namespace holdfast
