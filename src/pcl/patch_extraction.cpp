#include <holdfast/pcl/patch_extraction.h>

#include "sampling_budget.h"
#include <holdfast/patch/boundary.h>
#include <holdfast/sensor/constant_noise_model.h>

#include "parallel/parallel_for.h"
#include "point_gatherer.h"

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

/// Standard deviation assumed where the sensor's model cannot hold, m.
constexpr double kUnknownSigma = 1e-3;

void
requireValid(const std::string& error)
{
  if (!error.empty())
    throw std::invalid_argument(error);
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

/// Whether the sensor may have measured the point, with a factor of two for wide
/// lenses and long looks.
bool
isInView(const Sensor& sensor, const Eigen::Vector3d& in_camera)
{
  if (!(in_camera.z() > 0.0 && in_camera.z() <= 2.0 * sensor.max_range_m))
    return false;
  const Eigen::Vector2d pixel = sensor.camera.project(in_camera);
  return std::abs(pixel.x() - sensor.camera.cx) <= sensor.camera.width &&
         std::abs(pixel.y() - sensor.camera.cy) <= sensor.camera.height;
}

bool
isMostlyOutOfView(const RangeCloud& cloud, const Sensor& sensor)
{
  const std::vector<int> finite = finitePoints(cloud);
  const auto out_of_view = std::count_if(finite.begin(), finite.end(), [&](int index) {
    return !isInView(sensor, cloud.sensor_pose.toLocal(position(cloud, index)));
  });
  return 2 * static_cast<std::size_t>(out_of_view) > finite.size();
}

Sensor
withConstantNoise(Sensor sensor)
{
  sensor.noise = std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{kUnknownSigma, kUnknownSigma});
  return sensor;
}

/// The sensor itself, or one with constant noise where its own means nothing or, since
/// the cloud brings its covariances, is not asked.
Sensor
applicableSensor(const RangeCloud& cloud,
                 const Sensor& sensor,
                 std::vector<std::string>& notices)
{
  requireValid(validityError(cloud));
  const bool has_covariances = !cloud.covariances.empty();
  requireValid(sensor.noise || has_covariances ?
                   "" :
                   "the cloud has no covariances, and the sensor no noise model");
  if (!sensor.noise)
    return withConstantNoise(sensor);
  const bool organized = cloud.points->height > 1;
  if (has_covariances || sensor.noise->isOmnidirectional() || organized ||
      !isMostlyOutOfView(cloud, sensor))
    return sensor;
  notices.push_back("most points lie where the sensor " + sensor.name +
                    " cannot see: a noise of 1 mm in every direction is assumed; "
                    "another sensor or a covariance field changes that");
  return withConstantNoise(sensor);
}

FitOptions
checkedFitOptions(const RangeCloud& cloud, const ExtractionOptions& options)
{
  FitOptions fit = options.fit;
  fit.viewpoint = cloud.sensor_pose.c;
  requireValid(validityError(fit));
  return fit;
}

int
checkedThreads(int threads)
{
  requireValid(threads < 0 ? "the number of threads must not be negative" : "");
  return threadCount(threads);
}

/// Looks at attempts in the order of their seeds, in whatever order the threads come to
/// an end with them, so that what is looked at does not depend on the threads.
class InOrder {
public:
  /// \param look at an attempt; true when it was the last that is wanted.
  InOrder(std::size_t attempts, std::function<bool(std::size_t)> look)
  : is_done_(attempts, false), look_(std::move(look))
  {}

  void finish(int attempt)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_done_[static_cast<std::size_t>(attempt)] = true;
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

} // namespace

struct PatchExtractor::Impl {
  Impl(const RangeCloud& the_cloud, const Sensor& nominal, const ExtractionOptions& o)
  : cloud(the_cloud)
  , sensor(applicableSensor(cloud, nominal, notices))
  , radius_m(o.sampler.neighborhood == Neighborhood::Knn ? 0.0 : o.sampler.radius_m)
  , validation(o.validation)
  , progress(o.progress)
  , threads(checkedThreads(o.threads))
  , estimator(checkedFitOptions(cloud, o), o.covariance)
  , gatherer(cloud, sensor.noise, o.fit.noise_at_surface)
  {
    requireValid(validation ? validityError(*validation) : "");
  }

  /// \param batch working memory
  ExtractedPatch attempt(const std::vector<int>& indices,
                         const Eigen::Vector3d& origin,
                         PointBatch& batch) const;

  /// Fills attempts[i] and calls done(i), for every seed unless skip().
  void fitAround(const std::vector<Seed>& seeds,
                 const NeighborhoodSearch& search,
                 const std::function<bool()>& skip,
                 const std::function<void(int)>& done,
                 std::vector<ExtractedPatch>& attempts) const;

  std::vector<Seed> places(const std::vector<int>& indices) const;

  /// Refers to the sampler.
  NeighborhoodSearch searchOf(const NeighborhoodSampler& sampler) const;

  const SamplingBudget::Clock::time_point start = SamplingBudget::Clock::now();
  const RangeCloud& cloud;
  std::vector<std::string> notices;
  Sensor sensor;
  double radius_m;
  std::optional<ValidationOptions> validation;
  Progress progress;
  int threads;
  PatchEstimator estimator;
  PointGatherer gatherer;
};

ExtractedPatch
PatchExtractor::Impl::attempt(const std::vector<int>& indices,
                              const Eigen::Vector3d& origin,
                              PointBatch& batch) const
{
  ExtractedPatch patch;
  gatherer.gather(indices, origin, batch);
  patch.fit = estimator.estimate(batch);
  if (validation)
    patch.validation = validate(patch.fit, batch, *validation);
  return patch;
}

void
PatchExtractor::Impl::fitAround(const std::vector<Seed>& seeds,
                                const NeighborhoodSearch& search,
                                const std::function<bool()>& skip,
                                const std::function<void(int)>& done,
                                std::vector<ExtractedPatch>& attempts) const
{
  struct Workspace {
    std::vector<int> indices;
    PointBatch batch;
  };
  std::vector<Workspace> workspaces(static_cast<std::size_t>(threads));
  const auto fit_one = [&](int i, int thread) {
    if (skip())
      return;
    const Seed& seed = seeds[i];
    Workspace& work = workspaces[thread];
    search(seed, thread, work.indices);
    attempts[i] = attempt(work.indices, seed.position, work.batch);
    attempts[i].seed_index = seed.index;
    attempts[i].seed = seed.position;
    attempts[i].radius_m = radius_m;
    done(i);
  };
  parallelFor(static_cast<int>(seeds.size()), threads, fit_one, progress);
}

std::vector<Seed>
PatchExtractor::Impl::places(const std::vector<int>& indices) const
{
  std::vector<Seed> seeds;
  seeds.reserve(indices.size());
  for (const int index : indices)
    seeds.push_back({index, position(cloud, index)});
  return seeds;
}

NeighborhoodSearch
PatchExtractor::Impl::searchOf(const NeighborhoodSampler& sampler) const
{
  auto scratch = std::make_shared<std::vector<NeighborhoodSampler::ScratchPtr>>();
  for (int thread = 0; thread < threads; ++thread)
    scratch->push_back(sampler.makeScratch());
  return [&sampler, scratch](const Seed& seed, int thread, std::vector<int>& indices) {
    sampler.neighborhood(seed.index, *(*scratch)[thread], indices);
  };
}

PatchExtractor::PatchExtractor(const RangeCloud& cloud,
                               const Sensor& sensor,
                               const ExtractionOptions& options)
: impl_(std::make_unique<const Impl>(cloud, sensor, options))
{}

PatchExtractor::~PatchExtractor() = default;

std::vector<ExtractedPatch>
PatchExtractor::fitAround(const std::vector<Seed>& seeds,
                          const NeighborhoodSearch& search) const
{
  std::vector<ExtractedPatch> attempts(seeds.size());
  impl_->fitAround(
      seeds,
      search,
      [] { return false; },
      [](int) {},
      attempts);
  return attempts;
}

std::vector<ExtractedPatch>
PatchExtractor::fitAround(const std::vector<int>& seeds,
                          const NeighborhoodSampler& sampler) const
{
  return fitAround(impl_->places(seeds), impl_->searchOf(sampler));
}

std::vector<ExtractedPatch>
PatchExtractor::fitWithinLimits(const std::vector<int>& seeds,
                                const NeighborhoodSampler& sampler,
                                std::string* notice) const
{
  if (!isLimited(sampler.options()))
    return fitAround(seeds, sampler);
  const std::vector<Seed> places = impl_->places(seeds);
  std::vector<ExtractedPatch> attempts(seeds.size());
  SamplingBudget budget(sampler.options(), impl_->cloud.points->size(), impl_->start);
  const NeighborhoodSearch search_again = impl_->searchOf(sampler);
  std::vector<int> indices;
  InOrder count(seeds.size(), [&](std::size_t i) {
    if (isAccepted(attempts[i])) {
      if (budget.limitsArea())
        search_again(places[i], 0, indices);
      budget.cover(indices, projectedArea(attempts[i].fit.patch));
    }
    return budget.isFull();
  });
  impl_->fitAround(
      places,
      impl_->searchOf(sampler),
      [&] { return count.isOver() || budget.isOutOfTime(); },
      [&](int i) { count.finish(i); },
      attempts);
  attempts.resize(count.seen());
  if (notice && attempts.size() < seeds.size())
    *notice = "stopped at the limit of patches, area or time after " +
              std::to_string(attempts.size()) + " of " + std::to_string(seeds.size()) +
              " seeds";
  return attempts;
}

std::vector<ExtractedPatch>
PatchExtractor::fitSampled(const NeighborhoodSampler& sampler,
                           std::string* notice) const
{
  return fitWithinLimits(sampler.seeds(), sampler, notice);
}

ExtractedPatch
PatchExtractor::fitWhole() const
{
  const std::vector<int> indices = finitePoints(impl_->cloud);
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < indices.size(); ++i)
    centroid +=
        (position(impl_->cloud, indices[i]) - centroid) / static_cast<double>(i + 1);
  PointBatch batch;
  return impl_->attempt(indices, centroid, batch);
}

const Sensor&
PatchExtractor::sensor() const
{
  return impl_->sensor;
}

const std::vector<std::string>&
PatchExtractor::notices() const
{
  return impl_->notices;
}

int
PatchExtractor::countInvalidCovariances() const
{
  return impl_->gatherer.countInvalidCovariances();
}

bool
isAccepted(const ExtractedPatch& patch)
{
  return isUsable(patch.fit.status) &&
         (!patch.validation || patch.validation->verdict == PatchVerdict::Accepted);
}

ExtractionResult
sortOut(std::vector<ExtractedPatch> attempts)
{
  ExtractionResult result;
  for (ExtractedPatch& patch : attempts) {
    if (isAccepted(patch))
      result.patches.push_back(std::move(patch));
    else if (isUsable(patch.fit.status))
      ++result.turned_down[patch.validation->verdict];
    else
      ++result.rejected[patch.fit.status];
  }
  return result;
}

ExtractionResult
sortOut(std::vector<ExtractedPatch> attempts, const PatchExtractor& extractor)
{
  ExtractionResult result = sortOut(std::move(attempts));
  result.invalid_covariances = extractor.countInvalidCovariances();
  result.notices = extractor.notices();
  return result;
}

ExtractionResult
extractPatches(const RangeCloud& cloud,
               const Sensor& sensor,
               const ExtractionOptions& options)
{
  const PatchExtractor extractor(cloud, sensor, options);
  const NeighborhoodSampler sampler(cloud, extractor.sensor(), options.sampler);
  std::string notice;
  ExtractionResult result = sortOut(extractor.fitSampled(sampler, &notice), extractor);
  if (!notice.empty())
    result.notices.push_back(notice);
  return result;
}

ExtractionResult
extractWhole(const RangeCloud& cloud,
             const Sensor& sensor,
             const ExtractionOptions& options)
{
  const PatchExtractor extractor(cloud, sensor, options);
  return sortOut({extractor.fitWhole()}, extractor);
}

} // namespace holdfast
