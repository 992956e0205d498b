#include <holdfast/pcl/patch_extraction.h>

#include <holdfast/patch/boundary.h>

#include "extraction_advice.h"
#include "parallel/parallel_for.h"
#include "patch_choice.h"
#include "point_gatherer.h"
#include "point_selection.h"
#include "sampling_budget.h"

#include <pcl/common/point_tests.h>

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

void
requireValid(const std::string& error)
{
  if (!error.empty())
    throw std::invalid_argument(error);
}

void
requireValid(const ExtractionOptions& options)
{
  requireValid(validityError(options.fit));
  requireValid(options.validation ? validityError(*options.validation) : "");
  requireValid(options.max_overlap >= 0.0 && options.max_overlap <= 1.0 ?
                   "" :
                   "the overlap must lie between 0 and 1");
  requireValid(options.threads < 0 ? "the number of threads must not be negative" : "");
}

Eigen::Vector3d
position(const RangeCloud& cloud, int index)
{
  return (*cloud.points)[index].getVector3fMap().cast<double>();
}

std::vector<int>
finitePoints(const RangeCloud& cloud)
{
  std::vector<int> finite;
  for (int i = 0; i < static_cast<int>(cloud.points->size()); ++i)
    if (pcl::isFinite((*cloud.points)[i]))
      finite.push_back(i);
  return finite;
}

Eigen::Vector3d
centroid(const RangeCloud& cloud, const std::vector<int>& indices)
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < indices.size(); ++i)
    mean += (position(cloud, indices[i]) - mean) / static_cast<double>(i + 1);
  return mean;
}

/// Turns the points around a place into a patch. Refers to the selection.
class PatchMaker {
public:
  PatchMaker(const PointSelection& chosen, const ExtractionOptions& options)
  : side_(options.normal_side)
  , gatherer_(chosen.cloud, chosen.sensor, options.fit.noise_at_surface)
  , estimator_(options.fit, options.covariance)
  , validation_(options.validation)
  {
    // Where the sensor was not, or was we do not know where, nothing was seen at a
    // graze.
    if (validation_ &&
        (side_ != NormalSide::Viewpoint || !chosen.viewpoint_is_credible))
      validation_->max_view_angle_rad.reset();
    if (validation_ && chosen.noise_is_assumed)
      validation_->max_chi2_per_dof.reset();
    if (side_ == NormalSide::Outward)
      middle_ = centroid(chosen.cloud, finitePoints(chosen.cloud));
  }

  /// \param radius_m of the neighbourhood; 0: there is none
  /// \param batch working memory
  ExtractedPatch make(const std::vector<int>& indices,
                      const Eigen::Vector3d& place,
                      double radius_m,
                      PointBatch& batch) const
  {
    ExtractedPatch patch;
    patch.radius_m = radius_m;
    gatherer_.gather(indices, place, batch);
    turnNormals(place, batch);
    patch.fit = estimator_.estimate(batch);
    if (validation_)
      patch.validation = validate(patch.fit, batch, *validation_, radius_m);
    return patch;
  }

  /// As they hold for this cloud.
  const std::optional<ValidationOptions>& limits() const
  {
    return validation_;
  }

private:
  /// Makes the normal at a place show to the side that is wanted.
  void turnNormals(const Eigen::Vector3d& place, PointBatch& batch) const
  {
    constexpr double kFar = 1e3; // many patches away
    switch (side_) {
    case NormalSide::Viewpoint:
      break;
    case NormalSide::Outward:
      batch.setViewpoint(place + kFar * (place - middle_));
      break;
    case NormalSide::Up:
      batch.setViewpoint(place + kFar * Eigen::Vector3d::UnitZ());
      break;
    }
  }

  NormalSide side_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  PointGatherer gatherer_;
  PatchEstimator estimator_;
  std::optional<ValidationOptions> validation_;
};

/// Seeds and neighbourhoods, with nothing left open.
struct CompleteSites {
  std::vector<Seed> seeds;
  NeighborhoodSearch search;
  NeighborhoodSearch second_search; ///< may be none
  /// NeighborhoodSampler::strayShare(); none where the searches are the caller's
  std::function<double(const Seed&, const Patch&)> stray_share;
  double radius_m = 0.0; ///< of the neighbourhoods; 0: they have none
  bool promising = true; ///< else it has been said what is wrong
};

/// The neighbourhoods of a sampler, whose lifetime they share.
/// \param find NeighborhoodSampler::neighborhood or strictNeighborhood
template <typename Find>
NeighborhoodSearch
searchOf(const std::shared_ptr<const NeighborhoodSampler>& sampler,
         int threads,
         Find find)
{
  auto scratch = std::make_shared<std::vector<NeighborhoodSampler::ScratchPtr>>();
  for (int thread = 0; thread < threads; ++thread)
    scratch->push_back(sampler->makeScratch());
  return [=](const Seed& seed, int thread, std::vector<int>& indices) {
    (*sampler.*find)(seed.index, *(*scratch)[thread], indices);
  };
}

/// The seeds that come first, and of the others those that are free.
void
putFirst(const PatchSites& asked, std::vector<Seed>& seeds)
{
  if (asked.is_free)
    seeds.erase(std::remove_if(seeds.begin(), seeds.end(), std::not_fn(asked.is_free)),
                seeds.end());
  seeds.insert(seeds.begin(), asked.first_seeds.begin(), asked.first_seeds.end());
}

CompleteSites
completeSites(const PatchSites& asked,
              const ExtractionOptions& options,
              const PointSelection& chosen,
              std::vector<std::string>& notices)
{
  const bool knn = options.sampler.neighborhood == Neighborhood::Knn;
  CompleteSites sites;
  sites.radius_m = knn ? 0.0 : options.sampler.radius_m;
  sites.search = asked.search;
  sites.second_search = asked.second_search;
  if (asked.seeds)
    sites.seeds = *asked.seeds;
  if (asked.search)
    return sites;
  const auto sampler = std::make_shared<const NeighborhoodSampler>(chosen.cloud,
                                                                   chosen.sensor,
                                                                   options.sampler);
  const int threads = threadCount(options.threads);
  sites.search = searchOf(sampler, threads, &NeighborhoodSampler::neighborhood);
  if (options.sampler.neighborhood == Neighborhood::Patch)
    sites.second_search =
        searchOf(sampler, threads, &NeighborhoodSampler::strictNeighborhood);
  if (sampler->usesPixels())
    sites.stray_share = [sampler](const Seed& seed, const Patch& patch) {
      return sampler->strayShare(seed.index, patch);
    };
  if (const std::string notice = fallbackNotice(*sampler, chosen.cloud);
      !notice.empty())
    notices.push_back(notice);
  if (!asked.seeds) {
    sites.seeds = seedsAt(chosen.cloud, sampler->seeds());
    const std::size_t before = sites.seeds.size();
    keepPromisingSeeds(chosen, options.sampler, sites.search, sites.seeds, notices);
    sites.promising = sites.seeds.size() == before;
    putFirst(asked, sites.seeds);
  }
  return sites;
}

/// Looks at attempts in the order of their seeds, in whatever order the threads come to
/// an end with them, so that what is looked at does not depend on the threads.
class InOrder {
public:
  /// \param look at an attempt; true when it was the last that is wanted.
  InOrder(std::size_t attempts, std::function<bool(std::size_t)> look)
  : is_done_(attempts, false), look_(std::move(look))
  {}

  void finish(std::size_t attempt)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_done_[attempt] = true;
    while (!over_ && seen_ < is_done_.size() && is_done_[seen_])
      over_ = look_(seen_++);
  }

  bool isOver() const
  {
    return over_;
  }

  /// How many were looked at, when the threads are done.
  std::size_t seen() const
  {
    return seen_;
  }

private:
  std::mutex mutex_;
  std::vector<bool> is_done_;
  std::function<bool(std::size_t)> look_;
  std::size_t seen_ = 0;
  std::atomic<bool> over_{false};
};

/// The check that needs the pixels around the patch.
void
checkStray(const Seed& seed,
           const CompleteSites& sites,
           const std::optional<ValidationOptions>& limits,
           ExtractedPatch& patch)
{
  if (!sites.stray_share || !limits || !limits->max_stray || !isAccepted(patch))
    return;
  Validation& validation = *patch.validation;
  validation.stray_share = sites.stray_share(seed, patch.fit.patch);
  validation.verdict = verdictOf(validation, *limits, patch.radius_m);
}

/// True when another part of the neighbourhood may be what was asked for.
bool
deservesSecondAttempt(const ExtractedPatch& patch)
{
  return isUsable(patch.fit.status) && !isAccepted(patch) &&
         patch.validation->verdict != PatchVerdict::NormalNotSeen &&
         patch.validation->verdict != PatchVerdict::NoiseTooLarge;
}

/// Working memory of one thread.
struct Workspace {
  std::vector<int> indices;
  std::vector<int> first; ///< of a second attempt's patch, those of the first
  PointBatch batch;
};

/// The patch around a seed, of the second attempt where only that one is accepted.
ExtractedPatch
attemptAt(const Seed& seed,
          int thread,
          const CompleteSites& sites,
          const PatchMaker& maker,
          Workspace& work)
{
  const auto fitted = [&] {
    ExtractedPatch patch =
        maker.make(work.indices, seed.position, sites.radius_m, work.batch);
    checkStray(seed, sites, maker.limits(), patch);
    return patch;
  };
  sites.search(seed, thread, work.indices);
  ExtractedPatch patch = fitted();
  if (sites.second_search && deservesSecondAttempt(patch)) {
    work.first = work.indices;
    sites.second_search(seed, thread, work.indices);
    // The same points would give the same patch.
    ExtractedPatch second;
    if (work.indices != work.first)
      second = fitted();
    if (isAccepted(second)) {
      patch = std::move(second);
      patch.is_second_attempt = true;
    }
    else {
      work.indices.swap(work.first);
    }
  }
  patch.seed_index = seed.index;
  patch.seed = seed.position;
  return patch;
}

/// What came of the seeds, in their order.
struct Attempts {
  std::vector<ExtractedPatch> patches;
  std::vector<std::vector<int>> supports; ///< their points, where overlap counts
};

/// One attempt per seed, until the budget is spent.
/// \param memory to be used, whatever patches are in it
Attempts
attemptAll(const CompleteSites& sites,
           const PatchMaker& maker,
           const ExtractionOptions& options,
           const PatchObserver& observe,
           SamplingBudget& budget,
           std::vector<ExtractedPatch> memory)
{
  const std::size_t seeds = sites.seeds.size();
  const std::size_t kept = options.max_overlap < 1.0 ? seeds : 0;
  Attempts attempts{std::move(memory), std::vector<std::vector<int>>(kept)};
  attempts.patches.resize(seeds);
  std::vector<Workspace> workspaces(
      static_cast<std::size_t>(threadCount(options.threads)));
  // The points of attempts that wait to be looked at, where covered area counts.
  std::vector<std::vector<int>> covered(budget.limitsArea() ? seeds : 0);
  InOrder count(seeds, [&](std::size_t i) {
    const std::vector<int> points =
        covered.empty() ? std::vector<int>() : std::move(covered[i]);
    if (isAccepted(attempts.patches[i]))
      budget.cover(points, projectedArea(attempts.patches[i].fit.patch));
    return budget.isFull();
  });
  // Once it is, the seeds that are left do not each ask what time it is.
  std::atomic<bool> is_over{false};
  const auto attempt = [&](int item, int thread) {
    if (is_over || count.isOver() || budget.isOutOfTime()) {
      is_over = true;
      return;
    }
    const auto i = static_cast<std::size_t>(item);
    ExtractedPatch& patch = attempts.patches[i];
    Workspace& work = workspaces[static_cast<std::size_t>(thread)];
    patch = attemptAt(sites.seeds[i], thread, sites, maker, work);
    if (observe && isAccepted(patch))
      observe(i, patch, work.batch);
    if (!covered.empty())
      covered[i] = work.indices;
    if (kept > 0)
      attempts.supports[i] = work.indices;
    count.finish(i);
  };
  parallelFor(static_cast<int>(seeds), options.threads, attempt, options.progress);
  attempts.patches.resize(count.seen());
  attempts.supports.resize(std::min(kept, count.seen()));
  return attempts;
}

/// True when all seeds are tried and the best patches are taken, since nothing but
/// their number is limited.
bool
takesBest(const SamplerOptions& sampler, const PatchSites& asked)
{
  return sampler.max_patches > 0 && !asked.seeds && sampler.max_area_m2 == 0.0 &&
         sampler.max_time_s == 0.0;
}

SamplerOptions
limitsOf(const SamplerOptions& sampler, const PatchSites& asked)
{
  return takesBest(sampler, asked) ? withoutLimits(sampler) : sampler;
}

/// Leaves out what overlaps, then what is too many.
/// \param points in the cloud
void
choose(const ExtractionOptions& options,
       const PatchSites& asked,
       std::size_t points,
       Attempts& attempts,
       std::vector<std::string>& notices)
{
  if (options.max_overlap < 1.0) {
    const int left_out =
        thinOut(options.max_overlap, attempts.supports, points, attempts.patches);
    if (left_out > 0)
      notices.push_back(
          fmt::format("{} patches are left out, since better ones have their points",
                      left_out));
  }
  if (!takesBest(options.sampler, asked))
    return;
  const SamplerOptions& sampler = options.sampler;
  const int left_out = keepBest(static_cast<std::size_t>(sampler.max_patches),
                                sampler.spacing_m,
                                attempts.patches);
  if (left_out > 0)
    notices.push_back(fmt::format("the best {} of {} patches are given",
                                  sampler.max_patches,
                                  sampler.max_patches + left_out));
}

/// Attempts into patches and reasons.
void
sortOut(std::vector<ExtractedPatch> attempts,
        const ExtractionOptions& options,
        ExtractionResult& result)
{
  for (const ExtractedPatch& patch : attempts) {
    result.second_attempts += patch.is_second_attempt ? 1 : 0;
    if (!isUsable(patch.fit.status))
      ++result.rejected[patch.fit.status];
    else if (!isAccepted(patch))
      ++result.turned_down[patch.validation->verdict];
  }
  // In place: a patch with its covariance is two kilobytes.
  const auto isUnwanted = [&](const ExtractedPatch& patch) {
    return !options.keep_failures && !isAccepted(patch) &&
           !(options.keep_turned_down && isUsable(patch.fit.status));
  };
  attempts.erase(std::remove_if(attempts.begin(), attempts.end(), isUnwanted),
                 attempts.end());
  result.patches = std::move(attempts);
}

/// What is known before the first fit.
ExtractionResult
resultOf(const PointSelection& chosen, const ExtractionOptions& options)
{
  ExtractionResult result;
  result.points = chosen.points;
  result.sensor = chosen.sensor;
  result.viewpoint_is_credible = chosen.viewpoint_is_credible;
  result.notices = chosen.notices;
  if (!chosen.viewpoint_is_credible && options.normal_side == NormalSide::Viewpoint)
    result.notices.push_back(viewpointNotice(chosen.cloud));
  return result;
}

/// That not all seeds were tried, or why no patch was found.
void
noteWhatIsMissing(std::size_t tried,
                  const PatchSites& asked,
                  const CompleteSites& sites,
                  const PointSelection& chosen,
                  const SamplerOptions& sampler,
                  ExtractionResult& result)
{
  const bool all_tried = tried == sites.seeds.size();
  if (!asked.seeds && !all_tried)
    result.notices.push_back(fmt::format(
        "stopped at the limit of patches, area or time after {} of {} seeds",
        tried,
        sites.seeds.size()));
  // A stream has no time to measure an empty frame.
  const bool is_stream = asked.seeds && isLimited(sampler);
  if (sites.promising && all_tried && !is_stream)
    adviseOnNoPatches(chosen, sampler, result);
}

} // namespace

std::vector<ExtractedPatch>
acceptedAmong(std::vector<ExtractedPatch> attempts)
{
  const auto isRejected = [](const ExtractedPatch& patch) {
    return !isAccepted(patch);
  };
  attempts.erase(std::remove_if(attempts.begin(), attempts.end(), isRejected),
                 attempts.end());
  return attempts;
}

std::vector<Seed>
seedsAt(const RangeCloud& cloud, const std::vector<int>& indices)
{
  std::vector<Seed> seeds;
  seeds.reserve(indices.size());
  for (const int index : indices)
    seeds.push_back({index, position(cloud, index)});
  return seeds;
}

ExtractionResult
extractPatches(const RangeCloud& cloud,
               const Sensor& sensor,
               const ExtractionOptions& options,
               const PatchSites& asked,
               ExtractionResult former)
{
  const auto start = SamplingBudget::Clock::now();
  requireValid(options);
  // Cloud -> points that can be used, each with its covariance -> seeds and
  // neighbourhoods -> weighted fit -> bounded patch with covariance -> validation.
  const PointSelection chosen = selectPoints(cloud, sensor);
  const std::size_t points = chosen.cloud.points->size();
  ExtractionResult result = resultOf(chosen, options);
  const CompleteSites sites = completeSites(asked, options, chosen, result.notices);
  SamplingBudget budget(limitsOf(options.sampler, asked), points, start);
  Attempts attempts = attemptAll(sites,
                                 PatchMaker(chosen, options),
                                 options,
                                 asked.observe,
                                 budget,
                                 std::move(former.patches));
  const std::size_t tried = attempts.patches.size();
  choose(options, asked, points, attempts, result.notices);
  sortOut(std::move(attempts.patches), options, result);
  noteWhatIsMissing(tried, asked, sites, chosen, options.sampler, result);
  return result;
}

ExtractionResult
extractWhole(const RangeCloud& cloud,
             const Sensor& sensor,
             const ExtractionOptions& options)
{
  requireValid(options);
  const PointSelection chosen = selectPoints(cloud, sensor);
  ExtractionResult result = resultOf(chosen, options);
  const std::vector<int> points = finitePoints(chosen.cloud);
  PointBatch batch;
  sortOut({PatchMaker(chosen, options)
               .make(points, centroid(chosen.cloud, points), 0.0, batch)},
          options,
          result);
  return result;
}

} // namespace holdfast
