// Contact risk: a foothold at one yaw, and the ranking of a frame of 640 x 480.
#include "rough_cloud.h"

#include <holdfast/contact/foothold.h>
#include <holdfast/contact/risk_grid.h>
#include <holdfast/pcl/frame_mapping.h>

#include <benchmark/benchmark.h>

#include <algorithm>

namespace holdfast::benchmarks { namespace {

/// Of patches, m: the scene's ground bends too much for larger ones.
constexpr double kRadius = 0.02;

/// A sole that such a patch carries.
Foot
smallFoot()
{
  return rectangularFoot(1.2 * kRadius, 0.9 * kRadius);
}

/// The map of one frame of the benchmarks' scene, on which the load is along the view.
const PatchMap&
frameMap()
{
  static const PatchMap map = [] {
    const Scene scene = makeScene();
    ExtractionOptions options;
    options.sampler.radius_m = kRadius;
    options.sampler.spacing_m = 1.5 * kRadius;
    FrameMapper mapper(scene.sensor, mappingOptionsFor(scene.sensor, options));
    mapper.addStill(scene.cloud);
    return mapper.map();
  }();
  return map;
}

void
riskOfYaw(benchmark::State& state)
{
  constexpr int kYaws = 16;
  const PatchMap& map = frameMap();
  Placement placement;
  placement.load_direction = Eigen::Vector3d::UnitZ();
  const SurfacePrior prior = surfacePriorOf(map, placement.load_direction);
  std::size_t next = 0, evaluated = 0;
  for ([[maybe_unused]] auto _ : state) {
    const MapPatch& patch = map.patches()[next++ % map.patches().size()];
    const ContactSurface surface = contactSurfaceOf(map, patch, prior);
    placement.point = *middleOfSupport(surface);
    const auto risks = contactRisks(surface, smallFoot(), placement, kYaws);
    evaluated += risks.size();
    benchmark::DoNotOptimize(risks);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(evaluated));
  state.counters["us_per_yaw"] =
      benchmark::Counter(1e-6 * static_cast<double>(evaluated),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(riskOfYaw)->Name("risk_of_yaw")->Unit(benchmark::kMicrosecond);

/// \param state its argument: threads, 0 for all cores
void
riskRanking(benchmark::State& state)
{
  FootholdOptions options;
  options.load_direction = Eigen::Vector3d::UnitZ();
  options.threads = static_cast<int>(state.range(0));
  FootholdRanking ranking;
  const PatchMap& map = frameMap();
  for ([[maybe_unused]] auto _ : state)
    ranking = rankFootholds(map, smallFoot(), options);
  state.counters["patches"] = ranking.candidates;
  state.counters["footholds"] = static_cast<double>(ranking.footholds.size());
}
BENCHMARK(riskRanking)
    ->Name("risk_ranking")
    ->Arg(1)
    ->Arg(0)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void
riskOfGrid(benchmark::State& state)
{
  RiskGridOptions options;
  options.load_direction = Eigen::Vector3d::UnitZ();
  options.threads = 1;
  RiskGrid grid;
  const PatchMap& map = frameMap();
  for ([[maybe_unused]] auto _ : state)
    grid = riskGrid(map, smallFoot(), options);
  state.counters["cells"] = static_cast<double>(grid.rows) * grid.columns;
}
BENCHMARK(riskOfGrid)->Name("risk_grid")->Unit(benchmark::kMillisecond);

}} // namespace holdfast::benchmarks
