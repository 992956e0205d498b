/// \file What is fitted and how.
#pragma once

#include <holdfast/patch/types.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <string>

namespace holdfast {

/// What the caller asks for. Auto fits a paraboloid and lets the data decide its type
/// (stage I-3); Paraboloid makes no test: elliptic or hyperbolic by the signs. The
/// others force that type.
enum class SurfaceRequest : std::uint8_t {
  Auto,
  Paraboloid,
  Plane,
  Sphere,
  CircularCylinder,
  EllipticParaboloid,
  HyperbolicParaboloid,
  CylindricParaboloid,
  CircularParaboloid
};

/// How many requests leave the type to the data; the others follow in the order of the
/// surfaces.
inline constexpr int kOpenRequests = 2;

constexpr SurfaceRequest
requestFor(SurfaceType surface)
{
  return static_cast<SurfaceRequest>(kOpenRequests + static_cast<int>(surface));
}
static_assert(requestFor(SurfaceType::Plane) == SurfaceRequest::Plane &&
                  requestFor(SurfaceType::CircularParaboloid) ==
                      SurfaceRequest::CircularParaboloid,
              "requests follow the order of the surfaces");

/// The type that is forced; none for Auto and Paraboloid.
constexpr std::optional<SurfaceType>
surfaceOf(SurfaceRequest request)
{
  const int surface = static_cast<int>(request) - kOpenRequests;
  if (surface < 0)
    return std::nullopt;
  return static_cast<SurfaceType>(surface);
}

/// The residual that is minimised, as a function of the implicit form f(q), its
/// gradient g and the covariance Sigma of the point.
enum class Residual : std::uint8_t {
  /// f / sqrt(g Sigma g^T), first order in the distance (the paper's).
  Sampson,
  /// Exact Mahalanobis distance along Sigma g^T; no second-order bias.
  Ray
};

/// The containment that bounds can mean something for. They are multiples of the
/// points' own spread: below the first, a patch would be a thousandth of it, less than
/// the spacing of any cloud; above the second, it would reach beyond 4.9 sigmas, where
/// a neighbourhood has no point that could bear it out.
inline constexpr double kSmallestContainment = 1e-3;
inline constexpr double kLargestContainment = 1.0 - 1e-6;

struct FitOptions {
  SurfaceRequest surface = SurfaceRequest::Auto;
  /// Boundary of planes; other surfaces imply theirs.
  std::optional<BoundaryType> plane_boundary;
  /// Gamma: share of the points, per axis and if Gaussian, that the boundary encloses;
  /// from kSmallestContainment to kLargestContainment.
  double containment = 0.95;

  /// Curvatures below this are never told from zero, and closer together than this
  /// never told apart, however sure the data are, 1/m. A floor under the tests of stage
  /// I-3.
  double curvature_tolerance_per_m = 0.1;
  /// A surface that rises by less than this over its tangent plane within the patch's
  /// own extent counts as a plane, however sure its curvature is, m; 0: none does. For
  /// those to whom a curvature that is significant but of no consequence is none.
  double flat_within_m = 0.0;
  /// Test level of stage I-3: the probability of calling a true plane, circular or
  /// cylindric paraboloid something more complicated.
  double discrimination_level = 0.01;
  /// A fit with a larger curvature is rejected, 1/m.
  double max_curvature_per_m = 1e3;

  int max_iterations = 30;
  /// The iterations stop when the remaining Newton step is below this many sigmas.
  /// Gauss-Newton leaves a thirtieth of it at most, save where the surface misfits: the
  /// first exact Newton step is then within the tolerance of the last.
  double step_tolerance_sigma = 3e-5;
  /// The final exact Newton step is repeated while it is longer than this, in sigmas.
  /// The covariance is taken before the last step, and is right to about this (patches
  /// that fill a small part of the view) to twenty times this (noise that bends with
  /// the surface). The default's digits are had from sums in single precision but for
  /// what cancels; whoever asks for more gets doubles, which take longer.
  double polish_tolerance_sigma = 1e-6;
  /// Points whose covariance is (nearly) zero are given this isotropic sigma, m.
  double sigma_floor_m = 1e-6;

  /// Gives the part of the state's covariance that no pattern has made on its own, too:
  /// FitResult::white_state_covariance.
  bool separate_pattern = false;

  // Departures from the paper that make the estimate unbiased; see paper().
  Residual residual = Residual::Ray;
  /// Subtract the mean point covariance from the scatter matrix before PCA and moments:
  /// noise tilts the PCA normal and inflates the moments otherwise.
  bool debias_scatter = true;
  /// Evaluate the noise model at the surface, not at the noisy point. The fit takes
  /// covariances as they come: whoever evaluates the model honours this
  /// (computeReferencePoints).
  bool noise_at_surface = true;
  /// Normal of sphere and cylinder from the PCA, not from a weighted plane that does
  /// not fit them.
  bool normal_from_pca = true;
  /// Centre of a sphere's patch where the line of the normal through the centroid meets
  /// it, not at its apex along the normal from the fitted centre, which slides where
  /// the curvature is uncertain.
  bool centre_on_normal_line = true;
  /// Radius of circular bounds from the mean of the two moments, not from the larger
  /// one, which has a kink where they are equal.
  bool smooth_circle_radius = true;
  /// Types from chi-square tests on the curvature covariance, not from a fixed
  /// threshold.
  bool statistical_discrimination = true;

  /// The paper's choices, all departures switched off.
  static FitOptions paper();
};

/// The same options with surface and boundary forced, so that no test decides.
FitOptions withType(FitOptions options, PatchType type);

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const FitOptions& options);

} // namespace holdfast
