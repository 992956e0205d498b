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

/// Limits of what is accepted; a check without a limit always passes. The defaults are
/// what a robot can rest on: a patch about as large as was asked for, that its points
/// bear out. They are in terms of the radius of the neighbourhood and of the noise;
/// those of the radius do not apply where there was none.
struct ValidationOptions {
  /// Largest Validation::extent_m over the radius. A full disc has 1; a neighbourhood
  /// that noise or an edge has stretched by a third is another one than asked for.
  std::optional<double> max_extent = 1.3;
  /// Largest Validation::sagitta_m over the radius: a patch that bends by more than
  /// half of it is a bowl or a ridge, and its paraboloid no longer follows the surface.
  std::optional<double> max_sagitta = 0.5;
  /// Largest magnitude of a principal curvature times the radius: a sphere of the
  /// neighbourhood's own radius has 1, and all that is more was seen from its rim.
  std::optional<double> max_bend = 1.0;
  /// Largest SurfaceResidual::unexplained_m over the radius: a point that far off, and
  /// further than its own noise reaches, is an obstacle or another surface. What noise
  /// moves a third of the radius is none: a Kinect's does from 1.3 m on at 5 cm.
  std::optional<double> max_departure = 1.0 / 3.0;
  /// Largest Validation::noise_m over the radius: beyond it, which points belong to a
  /// neighbourhood is chance, and errors of the state no longer follow its covariance
  /// (`experiment consistency --limits`: NEES/dof 1.0 to 0.5, 1.1 to 0.7, 1.4 at 1).
  /// The radius is too small for the sensor there; for a Kinect's 5 cm from 3 m on.
  std::optional<double> max_noise = 0.7;
  /// Largest share of the pixels that see the bounded patch and measured a point
  /// elsewhere (NeighborhoodSampler::strayShare()): bounds follow from moments and
  /// reach beyond the points, perhaps over an edge. Asked where patches are extracted
  /// from organized clouds.
  std::optional<double> max_stray = 0.02;
  /// Largest angle between the normal and the ray from the sensor, rad: 85 degrees. A
  /// surface at a graze fills a pixel with a dozen of its widths; what normal comes out
  /// is that of an edge or of the noise. Not asked where the viewpoint is unknown.
  std::optional<double> max_view_angle_rad = 1.48;
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
  /// The default leaves out patches of which half is guessed.
  std::optional<double> min_coverage = 0.5;
  /// Largest chi-square over what it should be: misfit in units of the noise, 1 where
  /// the surface and the noise model are right. The default is beyond what noise does
  /// to any patch, so that it selects by the surface alone, and lets pass a noise model
  /// that is too small by 1.7.
  std::optional<double> max_chi2_per_dof = 3.0;
  CoverageOptions coverage;

  /// Nothing is turned down, all is measured.
  static ValidationOptions withoutLimits();
};

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const ValidationOptions& options);

/// Outcome of the checks; the first that fails counts: noise, extent, sagitta,
/// curvature, view, residual, departure, coverage, chi-square, edge.
enum class PatchVerdict : std::uint8_t {
  Accepted,
  NotUsable, ///< the fit has no usable patch, or there is no finite point
  CurvatureTooLarge,
  ResidualTooLarge,
  CoverageTooLow,
  ChiSquareTooLarge,
  ExtentTooLarge,
  SagittaTooLarge,
  DepartureTooLarge, ///< a single point
  NormalNotSeen, ///< the surface is at a graze
  OverEdge, ///< pixels that see the patch measured points elsewhere
  NoiseTooLarge ///< for the radius
};

/// "accepted", "curvature_too_large", ... as in the program's JSON.
std::string_view verdictName(PatchVerdict verdict);

/// The verdict and what was measured, which is there whatever the limits unless stated,
/// if the fit is usable.
struct Validation {
  PatchVerdict verdict = PatchVerdict::NotUsable;
  double curvature_per_m = 0.0; ///< largest magnitude at the centre
  /// Longer semi-axis of the uniform ellipse with the second moments of the patch's
  /// support, m: of an evenly filled disc its radius.
  double extent_m = 0.0;
  /// By how much the surface rises at most over its tangent plane within the bounds, m:
  /// the stronger curvature over the longer bound.
  double sagitta_m = 0.0;
  /// Root mean square error of a single point, m: of the trace of its covariance. Zero
  /// without covariances.
  double noise_m = 0.0;
  /// Nothing without a limit, or where the viewpoint is unknown.
  std::optional<double> view_angle_rad;
  /// Nothing without a limit, where pixels cannot tell, or where another check had
  /// turned the patch down.
  std::optional<double> stray_share;
  SurfaceResidual residual;
  Coverage coverage;
  double chi2_per_dof = 0.0; ///< zero without degrees of freedom
};

/// What other limits say of what was measured before. What was not measured then
/// passes.
/// \param radius_m as validate()
PatchVerdict verdictOf(const Validation& measured,
                       const ValidationOptions& options,
                       double radius_m = 0.0);

/// Checks a fit against the points it was made from. Takes no memory from the heap, and
/// a fraction of the time of the fit.
/// \param points the batch as PatchEstimator::estimate() left it.
/// \param radius_m of the neighbourhood; 0: there was none.
/// \throw std::invalid_argument when the options make no sense.
Validation validate(const FitResult& fit,
                    const PointBatch& points,
                    const ValidationOptions& options,
                    double radius_m = 0.0);

/// \param points in world coordinates; those that are not finite are left out. Seen
///        from an unknown viewpoint.
Validation validate(const FitResult& fit,
                    const std::vector<Eigen::Vector3d>& points,
                    const ValidationOptions& options,
                    double radius_m = 0.0);

} // namespace holdfast
