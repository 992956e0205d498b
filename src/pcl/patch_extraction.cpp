#include <holdfast/pcl/patch_extraction.h>

#include "point_gatherer.h"

#include <holdfast/sensor/constant_noise_model.h>

#include <pcl/common/point_tests.h>

#include <omp.h>

#include <algorithm>
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

/// The sensor itself, or one with constant noise where its own means nothing.
Sensor
applicableSensor(const RangeCloud& cloud,
                 const Sensor& sensor,
                 std::vector<std::string>& notices)
{
  const bool organized = cloud.points->height > 1;
  if (!cloud.covariances.empty() || sensor.noise->isOmnidirectional() || organized ||
      !isMostlyOutOfView(cloud, sensor))
    return sensor;
  notices.push_back("most points lie where the sensor " + sensor.name +
                    " cannot see: a noise of 1 mm in every direction is assumed; "
                    "another sensor or a covariance field changes that");
  Sensor applicable = sensor;
  applicable.noise = std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{kUnknownSigma, kUnknownSigma});
  return applicable;
}

Sensor
checkedSensor(const RangeCloud& cloud,
              const Sensor& sensor,
              std::vector<std::string>& notices)
{
  requireValid(validityError(cloud));
  requireValid(sensor.noise ? "" : "the sensor has no noise model");
  return applicableSensor(cloud, sensor, notices);
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
  return threads > 0 ? threads : omp_get_max_threads();
}

/// Tells the caller how far the work is, from one thread at a time, never backwards.
class ProgressReport {
public:
  ProgressReport(std::function<void(int, int)> tell, int total)
  : tell_(std::move(tell)), total_(total)
  {}

  void oneDone()
  {
    if (!tell_)
      return;
    // Not an OpenMP critical section: no exception may leave one.
    const std::lock_guard<std::mutex> lock(mutex_);
    ++done_;
    if (done_ % kEvery == 0 || done_ == total_)
      tell_(done_, total_);
  }

private:
  static constexpr int kEvery = 64;
  std::function<void(int, int)> tell_;
  std::mutex mutex_;
  int total_;
  int done_ = 0;
};

/// Calls work(item, thread) for every item below n. Exceptions must not leave a
/// parallel region: the first one waits until its end.
template <typename Work>
void
parallelFor(int n, int threads, Work&& work)
{
  std::exception_ptr error;
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
  for (int i = 0; i < n; ++i) {
    try {
      work(i, omp_get_thread_num());
    }
    catch (...) {
#pragma omp critical(holdfast_error)
      if (!error)
        error = std::current_exception();
    }
  }
  if (error)
    std::rethrow_exception(error);
}

/// What one thread keeps from patch to patch.
struct Workspace {
  explicit Workspace(const NeighborhoodSampler& sampler)
  : scratch(sampler.makeScratch())
  {}

  NeighborhoodSampler::ScratchPtr scratch;
  std::vector<int> indices;
  PointBatch batch;
};

std::vector<Workspace>
makeWorkspaces(const NeighborhoodSampler& sampler, int count)
{
  std::vector<Workspace> workspaces;
  for (int i = 0; i < count; ++i)
    workspaces.emplace_back(sampler);
  return workspaces;
}

/// Sorts fits into patches and rejects, in the order given.
void
collect(std::vector<ExtractedPatch>&& fits, ExtractionResult& result)
{
  for (ExtractedPatch& patch : fits) {
    if (isUsable(patch.fit.status))
      result.patches.push_back(std::move(patch));
    else
      ++result.rejected[patch.fit.status];
  }
}

} // namespace

ExtractionResult
extractPatches(const RangeCloud& cloud,
               const Sensor& sensor,
               const ExtractionOptions& options)
{
  ExtractionResult result;
  const Sensor applicable = checkedSensor(cloud, sensor, result.notices);
  const PatchEstimator estimator(checkedFitOptions(cloud, options), options.covariance);
  const NeighborhoodSampler sampler(cloud, applicable, options.sampler);
  const PointGatherer gatherer(cloud, applicable.noise, options.fit.noise_at_surface);
  result.invalid_covariances = gatherer.countInvalidCovariances();

  const std::vector<int> seeds = sampler.seeds();
  const int n = static_cast<int>(seeds.size());
  const int threads = checkedThreads(options.threads);
  std::vector<Workspace> workspaces = makeWorkspaces(sampler, threads);
  std::vector<ExtractedPatch> fits(seeds.size());
  ProgressReport progress(options.progress, n);
  parallelFor(n, threads, [&](int i, int thread) {
    Workspace& work = workspaces[thread];
    const Eigen::Vector3d seed = position(cloud, seeds[i]);
    sampler.neighborhood(seeds[i], *work.scratch, work.indices);
    gatherer.gather(work.indices, seed, work.batch);
    fits[i].fit = estimator.estimate(work.batch);
    fits[i].seed_index = seeds[i];
    fits[i].seed = seed;
    fits[i].radius_m = options.sampler.radius_m;
    progress.oneDone();
  });
  collect(std::move(fits), result);
  return result;
}

ExtractionResult
extractWhole(const RangeCloud& cloud,
             const Sensor& sensor,
             const ExtractionOptions& options)
{
  ExtractionResult result;
  const Sensor applicable = checkedSensor(cloud, sensor, result.notices);
  const PatchEstimator estimator(checkedFitOptions(cloud, options), options.covariance);
  const PointGatherer gatherer(cloud, applicable.noise, options.fit.noise_at_surface);
  result.invalid_covariances = gatherer.countInvalidCovariances();

  const std::vector<int> indices = finitePoints(cloud);
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < indices.size(); ++i)
    centroid += (position(cloud, indices[i]) - centroid) / static_cast<double>(i + 1);
  PointBatch batch;
  gatherer.gather(indices, centroid, batch);
  std::vector<ExtractedPatch> fits(1);
  fits[0].fit = estimator.estimate(batch);
  collect(std::move(fits), result);
  return result;
}

} // namespace holdfast
