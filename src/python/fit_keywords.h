/// \file The options of a fit by name.
#pragma once

#include <holdfast/fit/names.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/uncertainty/names.h>

#include "keywords.h"

#include <utility>

namespace holdfast::python {

/// What fit() is asked for.
struct FitRequest {
  FitOptions fit;
  CovarianceMode covariance = CovarianceMode::Exact;
};

/// The boundary of planes, or None.
template <typename Options, typename Fit>
void
addBoundary(Keywords<Options>& keywords, Fit fit)
{
  keywords.put(
      "plane_boundary",
      [fit](Options& o, py::handle value) {
        fit(o).plane_boundary.reset();
        if (!value.is_none())
          fit(o).plane_boundary = readWord(kBoundaryNames, "plane_boundary", value);
      },
      [](Options&) { return std::string("None"); },
      "of planes: ellipse, circle, rectangle or quad. None: an ellipse.");
}

template <typename Options, typename Fit>
void
addTolerances(Keywords<Options>& keywords, Fit fit)
{
  const auto of = [fit](auto member) {
    return [fit, member](Options& o) -> decltype(auto) { return (fit(o).*member); };
  };
  keywords
      .add("curvature_tolerance_per_m",
           of(&FitOptions::curvature_tolerance_per_m),
           "smaller curvatures are never told from zero, 1/m.")
      .add("flat_within_m",
           of(&FitOptions::flat_within_m),
           "what rises by less over its extent counts as a plane, m.")
      .add("discrimination_level",
           of(&FitOptions::discrimination_level),
           "probability of calling a simple surface something more complicated.")
      .add("max_curvature_per_m",
           of(&FitOptions::max_curvature_per_m),
           "fits with a larger curvature are rejected, 1/m.")
      .add("max_iterations", of(&FitOptions::max_iterations), "of the solver.")
      .add("step_tolerance_sigma",
           of(&FitOptions::step_tolerance_sigma),
           "where the iterations stop, in sigmas of the estimate.")
      .add("polish_tolerance_sigma",
           of(&FitOptions::polish_tolerance_sigma),
           "length of the last exact Newton step, in sigmas.")
      .add("sigma_floor_m",
           of(&FitOptions::sigma_floor_m),
           "given to points whose covariance is (nearly) zero, m.");
}

/// What departs from the paper.
template <typename Options, typename Fit>
void
addDepartures(Keywords<Options>& keywords, Fit fit)
{
  const auto of = [fit](auto member) {
    return [fit, member](Options& o) -> decltype(auto) { return (fit(o).*member); };
  };
  keywords
      .add("separate_pattern",
           of(&FitOptions::separate_pattern),
           "gives `white_covariance`, without what neighbouring pixels share.")
      .add("residual",
           kResidualNames,
           of(&FitOptions::residual),
           "ray: exact; sampson: of first order, the paper's.")
      .add("debias_scatter",
           of(&FitOptions::debias_scatter),
           "takes the noise out of the points' moments.")
      .add("noise_at_surface",
           of(&FitOptions::noise_at_surface),
           "asks the sensor's model at the surface, not at the noisy point.")
      .add("normal_from_pca",
           of(&FitOptions::normal_from_pca),
           "normal of spheres and cylinders from the points' moments.")
      .add("centre_on_normal_line",
           of(&FitOptions::centre_on_normal_line),
           "centre of a sphere's patch on the normal through the points' mean.")
      .add("smooth_circle_radius",
           of(&FitOptions::smooth_circle_radius),
           "radius of circles from the mean of both moments.")
      .add("statistical_discrimination",
           of(&FitOptions::statistical_discrimination),
           "types from chi-square tests, not from a fixed threshold.");
}

template <typename Options, typename Fit, typename Mode>
void
addFitOptions(Keywords<Options>& keywords, Fit fit, Mode mode)
{
  keywords.add(
      "surface",
      kSurfaceRequestNames,
      [fit](Options& o) -> SurfaceRequest& { return fit(o).surface; },
      "auto: the data decide; paraboloid: elliptic or hyperbolic; or one of\n"
      "        plane, sphere, circular_cylinder, elliptic_paraboloid,\n"
      "        hyperbolic_paraboloid, cylindric_paraboloid, circular_paraboloid.");
  addBoundary(keywords, fit);
  keywords.add(
      "containment",
      [fit](Options& o) -> double& { return fit(o).containment; },
      "share of the points, per axis, that the boundary encloses.");
  keywords.add("covariance",
               kCovarianceModeNames,
               mode,
               "how the covariance is computed: exact, gauss_newton, second_order,\n"
               "        stagewise, monte_carlo or auto.");
  addTolerances(keywords, fit);
  addDepartures(keywords, fit);
}

} // namespace holdfast::python
