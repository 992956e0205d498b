/// \file The options of an extraction by name.
#pragma once

#include "fit_keywords.h"

#include <holdfast/pcl/names.h>

namespace holdfast::python {

template <typename Options, typename Get>
void
addSampling(Keywords<Options>& keywords, Get get)
{
  const auto of = [get](auto member) {
    return [get, member](Options& o) -> decltype(auto) {
      return (get(o).sampler.*member);
    };
  };
  keywords.add("radius_m", of(&SamplerOptions::radius_m), "of the neighbourhoods, m.")
      .add("neighborhood",
           kNeighborhoodNames,
           of(&SamplerOptions::neighborhood),
           "patch: along the surface; disc, ball, geodesic or knn.")
      .add("k", of(&SamplerOptions::k), "points of a knn neighbourhood.")
      .add("seeds",
           kSeedStrategyNames,
           of(&SamplerOptions::strategy),
           "grid, random or poisson.")
      .add("spacing_m", of(&SamplerOptions::spacing_m), "between seeds, m.")
      .add("max_seeds",
           of(&SamplerOptions::max_seeds),
           "0: as many as the spacing gives.")
      .add("max_patches",
           of(&SamplerOptions::max_patches),
           "the best so many; 0: all there are.")
      .add("max_area_m2",
           of(&SamplerOptions::max_area_m2),
           "stop when so much is covered, m^2; 0: never.")
      .add("max_time_s",
           of(&SamplerOptions::max_time_s),
           "stop after this time, s; 0: never.")
      .add("random_seed",
           of(&SamplerOptions::random_seed),
           "of random and poisson seeds.")
      .add("jump_sigmas",
           of(&SamplerOptions::jump_sigmas),
           "pixels belong together below so many sigmas of depth,")
      .add("max_slope",
           of(&SamplerOptions::max_slope),
           "or this slope between them, m per m.");
}

template <typename Options, typename Get>
void
addChecks(Keywords<Options>& keywords, Get get)
{
  // Limits are those of patches that are checked at all.
  const auto of = [get](auto member) {
    return [get, member](Options& o) -> std::optional<double>& {
      return (*get(o).validation).*member;
    };
  };
  using V = ValidationOptions;
  keywords.add("max_extent", of(&V::max_extent), "largest extent over the radius.")
      .add("max_sagitta", of(&V::max_sagitta), "largest rise over the radius.")
      .add("max_bend", of(&V::max_bend), "largest curvature times the radius.")
      .add("max_departure",
           of(&V::max_departure),
           "largest distance of a single point over the radius.")
      .add("max_noise", of(&V::max_noise), "largest sigma of a point over the radius.")
      .add("max_stray",
           of(&V::max_stray),
           "largest share of pixels within the bounds that see something else.")
      .add("max_view_angle_rad",
           of(&V::max_view_angle_rad),
           "largest angle between normal and ray, rad.")
      .add("max_curvature_accepted_per_m",
           of(&V::max_curvature_per_m),
           "largest curvature, 1/m.")
      .add("max_residual_m", of(&V::max_residual_m), "largest rms residual, m.")
      .add("min_coverage", of(&V::min_coverage), "smallest share covered by points.")
      .add("max_chi2_per_dof", of(&V::max_chi2_per_dof), "largest chi2 per dof.");
}

/// Sampler, fit and checks; `get` leads from Options to ExtractionOptions.
template <typename Options, typename Get>
void
addExtractionOptions(Keywords<Options>& keywords, Get get)
{
  addSampling(keywords, get);
  addChecks(keywords, get);
  const auto of = [get](auto member) {
    return [get, member](Options& o) -> decltype(auto) { return (get(o).*member); };
  };
  keywords
      .add("max_overlap",
           of(&ExtractionOptions::max_overlap),
           "leave out patches of which better ones have more than this share; 1: none.")
      .add("normal_side",
           kNormalSideNames,
           of(&ExtractionOptions::normal_side),
           "viewpoint, outward or up.")
      .add("keep_failures",
           of(&ExtractionOptions::keep_failures),
           "a row for every seed, whatever became of it.")
      .add("keep_turned_down",
           of(&ExtractionOptions::keep_turned_down),
           "a row for what checks turned down, too.")
      .add("threads", of(&ExtractionOptions::threads), "0: one for each core.");
  addFitOptions(
      keywords,
      [get](Options& o) -> FitOptions& { return get(o).fit; },
      [get](Options& o) -> CovarianceMode& { return get(o).covariance; });
}

} // namespace holdfast::python
