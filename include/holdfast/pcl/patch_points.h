/// \file Which points patches were fitted to.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <vector>

namespace holdfast {

/// The points that each accepted patch was fitted to, ascending, as indices into the
/// cloud; empty where a patch is not accepted or has no seed. The neighbourhoods are
/// searched once more, which takes a small part of the time of the fits.
/// \param cloud,sensor,options,sites as extractPatches() was given them.
/// \param patches what it returned.
/// \throw std::invalid_argument as extractPatches().
std::vector<std::vector<int>> pointsOfPatches(
    const RangeCloud& cloud,
    const Sensor& sensor,
    const ExtractionOptions& options,
    const PatchSites& sites,
    const std::vector<ExtractedPatch>& patches);

} // namespace holdfast
