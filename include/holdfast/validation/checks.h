/// \file Is a fitted patch a good description of its neighbourhood? (As in SPL:
/// Kanoulas & Vona, ICRA 2013, with chi-square in addition.)
#pragma once

#include <holdfast/fit/result.h>
#include <holdfast/validation/coverage.h>
#include <holdfast/validation/residual.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Limits of what is accepted; a check without a limit always passes.
struct ValidationOptions {
  /// Largest magnitude of a principal curvature at the centre, 1/m: what a foot or hand
  /// can still rest on. (FitOptions has a limit of its own, far above, for what can be
  /// fitted.)
  std::optional<double> max_curvature_per_m;
  /// Largest SurfaceResidual::rms_m. It holds the noise along the normal as well, which
  /// alone makes it about one sigma.
  std::optional<double> max_residual_m;
  /// Smallest Coverage::share, 0 to 1. An evenly filled disc covers 0.75 to 1 of the
  /// patch that is fitted to it, but 0.6 to 0.8 where that is a plane bounded by a
  /// rectangle or quad: bounds follow from moments, and reach beyond the points of a
  /// plane.
  std::optional<double> min_coverage;
  /// Largest chi-square per degree of freedom: misfit in units of the noise, 1 where
  /// the surface and the noise model are right.
  std::optional<double> max_chi2_per_dof;
  CoverageOptions coverage;
};

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const ValidationOptions& options);

/// Outcome of the checks, in the order in which they are made; the first that fails
/// counts.
enum class PatchVerdict : std::uint8_t {
  Accepted,
  NotUsable, ///< the fit has no usable patch, or there is no finite point
  CurvatureTooLarge,
  ResidualTooLarge,
  CoverageTooLow,
  ChiSquareTooLarge
};

/// "accepted", "curvature_too_large", ... as in the program's JSON.
std::string_view verdictName(PatchVerdict verdict);

/// The verdict and what was measured, which is there whatever the limits, unless the
/// fit is not usable.
struct Validation {
  PatchVerdict verdict = PatchVerdict::NotUsable;
  double curvature_per_m = 0.0; ///< largest magnitude at the centre
  SurfaceResidual residual;
  Coverage coverage;
  double chi2_per_dof = 0.0; ///< zero without degrees of freedom
};

/// Checks a fit against the points it was made from. Takes no memory from the heap, and
/// a fraction of the time of the fit.
/// \param points the batch as PatchEstimator::estimate() left it.
/// \throw std::invalid_argument when the options make no sense.
Validation validate(const FitResult& fit,
                    const PointBatch& points,
                    const ValidationOptions& options);

/// \param points in world coordinates; those that are not finite are left out.
Validation validate(const FitResult& fit,
                    const std::vector<Eigen::Vector3d>& points,
                    const ValidationOptions& options);

} // namespace holdfast
