// The patch map: a frame's motion and measurements among ten thousand patches.
#include <holdfast/fusion/patch_map.h>
#include <holdfast/fusion/registration.h>
#include <holdfast/geometry/rotation.h>

#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <vector>

namespace holdfast { namespace {

constexpr int kPatches = 10'000;
constexpr double kSpacing = 0.05;

/// A level spot at a place, as a Kinect's patch of 5 cm at 1 m, with noise.
Measurement
measurementAt(std::uint64_t id,
              const Eigen::Vector3d& place,
              std::mt19937_64& generator)
{
  std::normal_distribution<double> normal;
  const JetVector sigma = (JetVector() << 6e-4, 0.01, 0.01, 0.6, 0.4, 0.6).finished();
  Measurement m;
  m.id = id;
  m.anchor = {frameFromZ(-Eigen::Vector3d::UnitZ()), place};
  m.jet.white = sigma.cwiseAbs2().asDiagonal();
  for (int i = 0; i < 6; ++i)
    m.jet.value[i] = sigma[i] * normal(generator);
  m.radius_m = 0.05;
  m.points = 140;
  m.moments = {6e-4, 0.0, 6e-4};
  m.moments_covariance = 1e-12 * Eigen::Matrix3d::Identity();
  m.design.by_third = thirdToJetOfDisc(m.radius_m);
  for (int row = 3; row < 13; ++row)
    for (int column = 3; column < 13; ++column)
      m.support.set(column, row);
  m.chi2 = m.chi2_expected = 134.0;
  return m;
}

std::vector<Measurement>
floorOf(int count, std::mt19937_64& generator)
{
  const int side = static_cast<int>(std::sqrt(kPatches));
  std::vector<Measurement> measurements;
  for (int i = 0; i < count; ++i)
    measurements.push_back(
        measurementAt(static_cast<std::uint64_t>(i + 1),
                      {kSpacing * (i % side - side / 2), kSpacing * (i / side), 1.0},
                      generator));
  return measurements;
}

PatchMap
largeMap(std::mt19937_64& generator)
{
  PatchMap map;
  map.update(floorOf(kPatches, generator));
  return map;
}

/// Motion, seeds and update of a frame.
void
mapFrame(benchmark::State& state)
{
  std::mt19937_64 generator(1);
  PatchMap map = largeMap(generator);
  const auto measurements = floorOf(static_cast<int>(state.range(0)), generator);
  const JetMatrix covariance = 1e-12 * JetMatrix::Identity();
  Pose step;
  for (auto _ : state) {
    step.c.x() = -step.c.x() + (step.c.x() == 0.0 ? 1e-4 : 0.0);
    map.move(step, covariance);
    benchmark::DoNotOptimize(map.wantedSeeds(Camera()));
    benchmark::DoNotOptimize(map.update(measurements));
  }
}
BENCHMARK(mapFrame)
    ->Name("map_frame")
    ->Arg(300)
    ->Arg(1000)
    ->Unit(benchmark::kMillisecond);

void
mapMove(benchmark::State& state)
{
  std::mt19937_64 generator(1);
  PatchMap map = largeMap(generator);
  const JetMatrix covariance = 1e-12 * JetMatrix::Identity();
  for (auto _ : state)
    map.move(Pose(), covariance);
}
BENCHMARK(mapMove)->Name("map_move")->Unit(benchmark::kMillisecond);

void
registration(benchmark::State& state)
{
  std::mt19937_64 generator(1);
  const PatchMap map = largeMap(generator);
  const auto measurements = floorOf(static_cast<int>(state.range(0)), generator);
  Pose guess;
  guess.c.z() = 0.002;
  for (auto _ : state)
    benchmark::DoNotOptimize(registerPatches(measurements, map, guess));
}
BENCHMARK(registration)
    ->Name("map_registration")
    ->Arg(300)
    ->Unit(benchmark::kMillisecond);

}} // namespace holdfast
