#include <holdfast/fit/options.h>

#include <cmath>

namespace holdfast {

FitOptions
FitOptions::paper()
{
  FitOptions options;
  options.residual = Residual::Sampson;
  options.debias_scatter = false;
  options.noise_at_surface = false;
  options.normal_from_pca = false;
  options.centre_on_normal_line = false;
  options.smooth_circle_radius = false;
  options.statistical_discrimination = false;
  return options;
}

FitOptions
withType(FitOptions options, PatchType type)
{
  options.surface = requestFor(type.surface);
  options.plane_boundary.reset();
  if (type.surface == SurfaceType::Plane)
    options.plane_boundary = type.boundary;
  return options;
}

std::string
validityError(const FitOptions& options)
{
  const auto inUnitInterval = [](double x) { return x > 0.0 && x < 1.0; };
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  if (options.plane_boundary && options.surface != SurfaceRequest::Plane &&
      options.surface != SurfaceRequest::Auto)
    return "a boundary can be chosen for planes only; other surfaces imply theirs";
  if (!(options.containment >= kSmallestContainment &&
        options.containment <= kLargestContainment))
    return "containment must lie between 0.001 and 0.999999";
  if (!inUnitInterval(options.discrimination_level))
    return "discrimination_level must lie between 0 and 1, both excluded";
  if (!(options.curvature_tolerance_per_m >= 0.0))
    return "curvature_tolerance_per_m must not be negative";
  if (!(options.flat_within_m >= 0.0 && std::isfinite(options.flat_within_m)))
    return "flat_within_m must not be negative";
  if (!positive(options.max_curvature_per_m))
    return "max_curvature_per_m must be a positive number";
  if (options.max_iterations < 1)
    return "max_iterations must be at least 1";
  if (!positive(options.step_tolerance_sigma) ||
      !positive(options.polish_tolerance_sigma))
    return "step tolerances must be positive numbers";
  if (!(options.sigma_floor_m >= 0.0))
    return "sigma_floor_m must not be negative";
  return {};
}

} // namespace holdfast
