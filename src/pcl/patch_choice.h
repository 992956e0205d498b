/// \file Which of the accepted patches are given, where not all are wanted.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <vector>

namespace holdfast {

/// How good an accepted patch is to rest on, at most 1:
///
///     coverage / (max(1, chi2 over its expectation) (1 + sigma of the normal / 0.1)),
///
/// the share of it that points bear out, less where the surface is not quite what was
/// fitted and where its normal is uncertain (0.1 rad: half as good).
double quality(const ExtractedPatch& patch);

/// Keeps the best patches, those of equal quality in the order of the seeds: first
/// those whose centres are a spacing apart from each better one, then, if that makes
/// too few, the others. Attempts that are not accepted stay. The order is kept. \return
/// how many were left out.
int keepBest(std::size_t count,
             double spacing_m,
             std::vector<ExtractedPatch>& attempts);

/// Leaves out patches of which better ones have more than this share of the points.
/// Attempts that are not accepted stay. The order is kept.
/// \param supports indices of the points of each attempt, below `points`.
/// \return how many were left out.
int thinOut(double max_overlap,
            const std::vector<std::vector<int>>& supports,
            std::size_t points,
            std::vector<ExtractedPatch>& attempts);

} // namespace holdfast
