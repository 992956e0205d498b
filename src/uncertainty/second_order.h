/// \file Second-order propagation through the stages after the fit.
#pragma once

#include "fit/fit_patch.h"

namespace holdfast {

/// What second order adds to the first.
struct SecondOrderTerms {
  /// tr(F_a'' S F_b'' S) / 2: added to the first-order covariance.
  ParameterMatrix covariance;
  /// tr(F_a'' S) / 2, by which the mean of the estimate is off the patch of the mean
  /// points. Reported, not applied: estimate - shift is unbiased, but a confidence
  /// region belongs at estimate + shift.
  ParameterVector shift;
  StateMatrix state_covariance; ///< the same, of the state
  StateVector state_shift;
};

/// Pushes the joint Gaussian of surface and moments (theta, s) through the second
/// derivatives of the map F from there to [d | k | r | c] and to the state, found by
/// differencing
/// PatchFitter::bound() over one sigma along the principal directions of that Gaussian:
/// over the range in which the estimate really moves.
/// \param joint covariance of (theta, mean, scatter[, plane stage]) in the axes of the
///        surface (JointLayout); singular is fine.
SecondOrderTerms secondOrderTerms(
    const PatchFit& fit,
    const PatchFitter& fitter,
    const Eigen::Vector3d& origin,
    const Eigen::Matrix<double, JointLayout::kSize, JointLayout::kSize>& joint);

} // namespace holdfast
