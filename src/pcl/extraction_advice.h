/// \file What to tell those whose cloud or options do not go together.
#pragma once

#include "point_selection.h"

#include <holdfast/pcl/patch_extraction.h>

#include <string>
#include <vector>

namespace holdfast {

/// Why discs were asked for and balls are used; empty where that is not so.
std::string fallbackNotice(const NeighborhoodSampler& sampler, const RangeCloud& cloud);

/// What an assumed viewpoint that the points contradict means.
std::string viewpointNotice(const RangeCloud& cloud);

/// Tries the neighbourhoods of a few seeds. Where hardly any has points, or each holds
/// the whole cloud, unit or radius are wrong: the few are kept, the others left out
/// with a notice that says so.
void keepPromisingSeeds(const PointSelection& chosen,
                        const SamplerOptions& sampler,
                        const NeighborhoodSearch& search,
                        std::vector<Seed>& seeds,
                        std::vector<std::string>& notices);

/// Adds a notice with the likely cause where a result holds no patch.
void adviseOnNoPatches(const PointSelection& chosen,
                       const SamplerOptions& sampler,
                       ExtractionResult& result);

} // namespace holdfast
