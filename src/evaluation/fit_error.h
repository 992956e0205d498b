/// \file How far a fit is from where it should be, in sigmas of its own covariance.
#pragma once

#include <holdfast/evaluation/consistency.h>
#include <holdfast/fit/result.h>

namespace holdfast {

/// Of one fit.
struct NormalizedError {
  double nees_per_dof = 0.0; ///< squared error over the rank of its covariance
  bool within95 = false; ///< inside the 95 % ellipsoid
};

/// x^T S^+ x and the rank of S.
struct Mahalanobis {
  double squared = 0.0;
  int rank = 0;
};

Mahalanobis mahalanobis(const ParameterVector& error,
                        const ParameterMatrix& covariance);

NormalizedError normalizedError(const ParameterVector& error,
                                const ParameterMatrix& covariance);

/// Error of a patch in the tangent space [d | k | delta | c] of the reference.
ParameterVector tangentError(const Patch& patch, const Patch& reference);

/// The mean shift of the parameters in the tangent space; zero without one.
ParameterVector tangentShift(const FitResult& fit);

/// Of the parameters of a usable fit. The region of confidence lies about the estimate
/// plus its second-order shift, where there is one.
NormalizedError parameterError(const FitResult& fit, const Patch& reference);

/// Of the state of a usable fit, in its free coordinates: the curvature matrix of a
/// cylinder has two, kxx - kyy and kxy, since its rank is one.
NormalizedError stateError(const FitResult& fit, const PatchState& reference);

/// Of each group of the state's coordinates alone: [M], [k], [nu], [c]. Those a type
/// does not have are left out of `tallies`.
void addGroupErrors(const FitResult& fit,
                    const PatchState& reference,
                    StateTallies& tallies);

/// Of the surface alone: of the normal's two angles and the height of the centre along
/// the normal.
NormalizedError surfaceError(const FitResult& fit, const PatchState& reference);

/// |kappa| in sigmas, of the (first) curvature of a usable fit; infinite without one.
double curvatureInSigmas(const FitResult& fit);

void add(ErrorTally& tally, const NormalizedError& error);
void add(ErrorTally& tally, const ErrorTally& other);
void add(StateTallies& tallies, const StateTallies& others);

} // namespace holdfast
