#include <holdfast/pcl/patch_points.h>

#include "parallel/parallel_for.h"
#include "point_selection.h"

#include <memory>

namespace holdfast {

namespace {

/// The sampler's two searches, with scratch memory of their own.
class SamplerSearch {
public:
  SamplerSearch(const PointSelection& chosen,
                const SamplerOptions& options,
                int threads)
  : sampler_(chosen.cloud, chosen.sensor, options)
  {
    for (int thread = 0; thread < threads; ++thread)
      scratch_.push_back(sampler_.makeScratch());
  }

  void find(const ExtractedPatch& patch, int thread, std::vector<int>& indices) const
  {
    NeighborhoodSampler::Scratch& scratch = *scratch_[static_cast<std::size_t>(thread)];
    if (patch.is_second_attempt)
      sampler_.strictNeighborhood(*patch.seed_index, scratch, indices);
    else
      sampler_.neighborhood(*patch.seed_index, scratch, indices);
  }

private:
  NeighborhoodSampler sampler_;
  std::vector<NeighborhoodSampler::ScratchPtr> scratch_;
};

} // namespace

std::vector<std::vector<int>>
pointsOfPatches(const RangeCloud& cloud,
                const Sensor& sensor,
                const ExtractionOptions& options,
                const PatchSites& sites,
                const std::vector<ExtractedPatch>& patches)
{
  const PointSelection chosen = selectPoints(cloud, sensor);
  const int threads = threadCount(options.threads);
  std::unique_ptr<const SamplerSearch> sampler;
  if (!sites.search)
    sampler = std::make_unique<SamplerSearch>(chosen, options.sampler, threads);
  std::vector<std::vector<int>> points(patches.size());
  const auto find = [&](int item, int thread) {
    const auto i = static_cast<std::size_t>(item);
    const ExtractedPatch& patch = patches[i];
    if (!isAccepted(patch) || !patch.seed_index)
      return;
    const Seed seed{*patch.seed_index, patch.seed};
    if (sampler)
      sampler->find(patch, thread, points[i]);
    else if (patch.is_second_attempt)
      sites.second_search(seed, thread, points[i]);
    else
      sites.search(seed, thread, points[i]);
  };
  parallelFor(static_cast<int>(patches.size()), options.threads, find);
  return points;
}

} // namespace holdfast
