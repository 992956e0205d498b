/// \file What a patch costs, beside what it is built to replace.
///
/// All cases work on the same scene, one thread unless the name says otherwise; `us` is
/// the time per patch (or normal), on the processor, on the wall where there are more
/// threads; `points` is the true mean size of a neighbourhood.
/// Trees are built, and neighbourhoods of fit_covariance and ceres_autodiff gathered,
/// before the clock starts; whole_chain and pcl_normal include their search, and
/// whole_chain its share of the frame's preparation (case frame_preparation).
/// whole_chain_pattern is the same with errors that neighbouring pixels share;
/// repeated_chain, on one cloud after another, uses the memory of the last result
/// again, and `faults` are the page faults of a cloud. Of all times of a case the least
/// counts there, since anything else on the machine only adds. HOLDFAST_TARGET=AVX2
/// (or SSSE3) measures what the fit takes on processors without more; the
/// context says which instruction set is used.
#include "ceres_paraboloid.h"
#include "rough_cloud.h"
#include "target.h"

#include <holdfast/pcl/patch_extraction.h>

#include <pcl/features/normal_3d.h>
#include <pcl/search/kdtree.h>
#include <pcl/search/organized.h>

#include <benchmark/benchmark.h>

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::benchmarks { namespace {

const Scene&
scene()
{
  static const Scene the_scene = makeScene();
  return the_scene;
}

/// Radius of Disc or Ball for a mean size, found once.
double
cachedRadius(Neighborhood neighborhood, int points)
{
  static std::map<std::pair<Neighborhood, int>, double> radii;
  const auto key = std::make_pair(neighborhood, points);
  const auto known = radii.find(key);
  if (known != radii.end())
    return known->second;
  return radii[key] = radiusFor(scene(), neighborhood, points);
}

SamplerOptions
samplerOptions(Neighborhood neighborhood, int points)
{
  return makeSamplerOptions(neighborhood, cachedRadius(neighborhood, points));
}

enum class Clock { Processor, Wall };

double
now_us(Clock clock)
{
  if (clock == Clock::Processor)
    return 1e6 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  const auto wall = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::micro>(wall).count();
}

/// Runs round() until the benchmark has seen enough; a round does `patches` patches.
template <typename Round>
void
measure(benchmark::State& state,
        std::size_t patches,
        Round&& round,
        Clock clock = Clock::Processor)
{
  const double start = now_us(clock);
  for ([[maybe_unused]] auto _ : state)
    round();
  const double elapsed = now_us(clock) - start;
  const auto total = static_cast<double>(patches * state.iterations());
  state.SetItemsProcessed(static_cast<std::int64_t>(total));
  state.counters["us"] = elapsed / total;
}

/// The scene's sensor with the waves of a Kinect, a tenth as high as its noise is.
Sensor
patternedSensor()
{
  Sensor sensor = scene().sensor;
  sensor.pattern.waves = {{0.0089, 2.1, PatternShape::Exponential},
                          {0.0103, 79.0, PatternShape::Exponential}};
  return sensor;
}

std::size_t
attemptsOf(const ExtractionResult& result)
{
  std::size_t attempts = result.patches.size();
  for (const auto& rejected : result.rejected)
    attempts += static_cast<std::size_t>(rejected.second);
  for (const auto& turned_down : result.turned_down)
    attempts += static_cast<std::size_t>(turned_down.second);
  return attempts;
}

void
wholeChain(benchmark::State& state, const Sensor& sensor, int points, int threads)
{
  ExtractionOptions options;
  options.sampler = samplerOptions(Neighborhood::Patch, points);
  options.threads = threads;
  const ExtractionResult once = extractPatches(scene().cloud, sensor, options);
  const std::size_t seeds = attemptsOf(once);
  measure(
      state,
      seeds,
      [&] { benchmark::DoNotOptimize(extractPatches(scene().cloud, sensor, options)); },
      threads == 1 ? Clock::Processor : Clock::Wall);
  state.counters["points"] = meanSize(scene(), options.sampler);
  state.counters["accepted"] =
      static_cast<double>(once.patches.size()) / static_cast<double>(seeds);
}

/// Page faults of this process that took no disk.
long
pageFaults()
{
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

void
repeatedChain(benchmark::State& state, int points)
{
  ExtractionOptions options;
  options.sampler = samplerOptions(Neighborhood::Patch, points);
  options.threads = 1;
  ExtractionResult result;
  const auto again = [&] {
    result =
        extractPatches(scene().cloud, scene().sensor, options, {}, std::move(result));
  };
  for (int i = 0; i < 3; ++i)
    again();
  const auto seeds = static_cast<double>(attemptsOf(result));
  const long faults = pageFaults();
  double least_us = std::numeric_limits<double>::infinity();
  for ([[maybe_unused]] auto _ : state) {
    const double start = now_us(Clock::Processor);
    again();
    least_us = std::min(least_us, now_us(Clock::Processor) - start);
  }
  state.counters["us"] = least_us / seeds;
  state.counters["faults"] = static_cast<double>(pageFaults() - faults) /
                             static_cast<double>(state.iterations());
  state.counters["points"] = meanSize(scene(), options.sampler);
}

void
framePreparation(benchmark::State& state)
{
  const SamplerOptions options = samplerOptions(Neighborhood::Patch, 100);
  measure(state, 1, [&] {
    const NeighborhoodSampler sampler(scene().cloud, scene().sensor, options);
    benchmark::DoNotOptimize(sampler.seeds());
  });
}

void
neighborhoods(benchmark::State& state, int points)
{
  const SamplerOptions options = samplerOptions(Neighborhood::Patch, points);
  const NeighborhoodSampler sampler(scene().cloud, scene().sensor, options);
  const auto scratch = sampler.makeScratch();
  const std::vector<int> seeds = sampler.seeds();
  std::vector<int> indices;
  measure(state, seeds.size(), [&] {
    for (const int seed : seeds) {
      sampler.neighborhood(seed, *scratch, indices);
      benchmark::DoNotOptimize(indices.data());
    }
  });
  state.counters["points"] = meanSize(scene(), options);
}

void
fitCovariance(benchmark::State& state, int points, CovarianceMode mode)
{
  const SamplerOptions options = samplerOptions(Neighborhood::Patch, points);
  std::vector<PointBatch> batches = gatherBatches(scene(), options);
  const PatchEstimator estimator(FitOptions{}, mode);
  double iterations = 0.0;
  double curved = 0.0;
  for (PointBatch& batch : batches) {
    const FitResult fit = estimator.estimate(batch);
    iterations += fit.iterations;
    curved += fit.patch.type.surface != SurfaceType::Plane;
  }
  measure(state, batches.size(), [&] {
    for (PointBatch& batch : batches)
      benchmark::DoNotOptimize(estimator.estimate(batch));
  });
  const auto count = static_cast<double>(batches.size());
  state.counters["points"] = meanSize(scene(), options);
  state.counters["iterations"] = iterations / count;
  state.counters["curved"] = curved / count;
}

template <typename Search>
void
pclNormal(benchmark::State& state, int points)
{
  // PCL searches balls: their radius is set for the same mean size.
  const SamplerOptions options = samplerOptions(Neighborhood::Ball, points);
  const NeighborhoodSampler sampler(scene().cloud, scene().sensor, options);
  const auto search = pcl::make_shared<Search>();
  search->setInputCloud(scene().cloud.points);
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(scene().cloud.points);
  estimation.setSearchMethod(search);
  estimation.setRadiusSearch(options.radius_m);
  const auto seeds = pcl::make_shared<pcl::Indices>(sampler.seeds());
  estimation.setIndices(seeds);
  pcl::PointCloud<pcl::Normal> normals;
  measure(state, seeds->size(), [&] {
    estimation.compute(normals);
    benchmark::DoNotOptimize(normals.points.data());
  });
  state.counters["points"] = meanSize(scene(), options);
}

#ifdef HOLDFAST_HAVE_CERES
void
ceresAutodiff(benchmark::State& state, int points)
{
  const SamplerOptions options = samplerOptions(Neighborhood::Patch, points);
  std::vector<PointBatch> batches = gatherBatches(scene(), options);
  batches.resize(200); // slow: a few are enough
  double converged = 0.0;
  for (const PointBatch& batch : batches)
    converged += fitWithCeres(batch).converged;
  measure(state, batches.size(), [&] {
    for (const PointBatch& batch : batches)
      benchmark::DoNotOptimize(fitWithCeres(batch));
  });
  state.counters["points"] = meanSize(scene(), options);
  state.counters["converged"] = converged / static_cast<double>(batches.size());
}
#endif

void
registerCases()
{
  const auto add = [](const std::string& name, auto&& run) {
    benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
  };
  for (const int n : {100, 400}) {
    const std::string size = "/" + std::to_string(n);
    add("whole_chain" + size,
        [n](benchmark::State& s) { wholeChain(s, scene().sensor, n, 1); });
    add("repeated_chain" + size, [n](benchmark::State& s) { repeatedChain(s, n); });
    add("whole_chain_pattern" + size,
        [n](benchmark::State& s) { wholeChain(s, patternedSensor(), n, 1); });
    for (const CovarianceMode mode : kAllCovarianceModes)
      if (mode != CovarianceMode::MonteCarlo)
        add("fit_" + std::string(covarianceModeName(mode)) + size,
            [n, mode](benchmark::State& s) { fitCovariance(s, n, mode); });
    add("neighborhood" + size, [n](benchmark::State& s) { neighborhoods(s, n); });
    add("pcl_normal_kdtree" + size, [n](benchmark::State& s) {
      pclNormal<pcl::search::KdTree<pcl::PointXYZ>>(s, n);
    });
    add("pcl_normal_organized" + size, [n](benchmark::State& s) {
      pclNormal<pcl::search::OrganizedNeighbor<pcl::PointXYZ>>(s, n);
    });
#ifdef HOLDFAST_HAVE_CERES
    add("ceres_autodiff" + size, [n](benchmark::State& s) { ceresAutodiff(s, n); });
#endif
  }
  add("whole_chain_threads/2",
      [](benchmark::State& s) { wholeChain(s, scene().sensor, 100, 2); });
  add("frame_preparation", framePreparation);
}

/// The usual table, and after it each time as a multiple of PCL's normal with a k-d
/// tree on neighbourhoods of the same size.
class RatioReporter : public benchmark::ConsoleReporter {
public:
  void ReportRuns(const std::vector<Run>& runs) override
  {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
      if (const auto us = run.counters.find("us");
          run.run_type == Run::RT_Iteration && us != run.counters.end())
        times_us_.emplace_back(run.benchmark_name(), us->second.value);
  }

  void Finalize() override
  {
    std::printf("\n%-28s %12s %22s\n", "per patch", "us", "of pcl_normal_kdtree");
    for (const auto& [name, us] : times_us_) {
      const double reference = referenceFor(name);
      if (reference > 0.0)
        std::printf("%-28s %12.2f %21.2fx\n", name.c_str(), us, us / reference);
    }
  }

private:
  /// Time of PCL's normal at the size that the name ends in; 100 for the threads.
  double referenceFor(const std::string& name) const
  {
    const std::string tail = name.substr(name.rfind('/') + 1);
    const std::string size = tail == "400" ? "400" : "100";
    if (name == "frame_preparation")
      return 0.0;
    for (const auto& [other, us] : times_us_)
      if (other == "pcl_normal_kdtree/" + size)
        return us;
    return 0.0;
  }

  std::vector<std::pair<std::string, double>> times_us_;
};

}} // namespace holdfast::benchmarks

int
main(int argc, char** argv)
{
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv))
    return 1;
  try {
    benchmark::AddCustomContext("instruction set",
                                holdfast::benchmarks::chooseTarget());
  }
  catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  holdfast::benchmarks::registerCases();
  holdfast::benchmarks::RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  return 0;
}
