/// \file Where extracted patches come from.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <vector>

namespace holdfast::test {

/// Indices of the seeds of the accepted patches, in their order.
inline std::vector<int>
seedsOf(const ExtractionResult& result)
{
  std::vector<int> seeds;
  for (const ExtractedPatch& patch : result.patches)
    seeds.push_back(*patch.seed_index);
  return seeds;
}

} // namespace holdfast::test
