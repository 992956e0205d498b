/// \file How time and memory grow with points and patches of an unorganized cloud.
///
///   holdfast_scale_benchmark [MOST_POINTS]      10 million unless said otherwise
///
/// The cloud is a survey: hills, one point per square centimetre in random order, 3 mm
/// of noise. Times are of the processor, one thread. Each table ends with the exponent
/// p of time = c n^p through its rows, by least squares of the logarithms.
#include "pcl/ball_grid.h"

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/constant_noise_model.h>

#include <pcl/kdtree/kdtree_flann.h>

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace holdfast::benchmarks { namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

constexpr double kPointSpacing = 0.01; // m
constexpr double kRadius = 0.0564; // m: 100 points

Points::Ptr
survey(int n)
{
  std::mt19937_64 generator(1);
  const double side = kPointSpacing * std::sqrt(static_cast<double>(n));
  std::uniform_real_distribution<double> place(0.0, side);
  std::normal_distribution<double> noise(0.0, 0.003);
  auto points = pcl::make_shared<Points>();
  points->reserve(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const double x = place(generator), y = place(generator);
    const double z = 0.1 * std::sin(3.0 * x) * std::cos(3.0 * y) + noise(generator);
    points->push_back(pcl::PointXYZ(static_cast<float>(x),
                                    static_cast<float>(y),
                                    static_cast<float>(z)));
  }
  return points;
}

double
processorSeconds()
{
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// A line of /proc/self/status, MB.
double
statusMegabytes(const std::string& name)
{
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line))
    if (line.rfind(name + ':', 0) == 0)
      return std::atof(line.c_str() + name.size() + 1) / 1024.0;
  return std::nan("");
}

/// Time of some work, and the most memory it had beyond what was there before.
struct Cost {
  double seconds = 0.0;
  double megabytes = 0.0;
};

template <typename Work>
Cost
costOf(Work&& work)
{
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5 << std::flush; // forgets the peak
  const double before = statusMegabytes("VmRSS");
  const double start = processorSeconds();
  work();
  const double seconds = processorSeconds() - start;
  return {seconds, statusMegabytes("VmHWM") - before};
}

/// Of the slope through the logarithms.
double
exponent(const std::vector<double>& n, const std::vector<double>& seconds)
{
  double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
  for (std::size_t i = 0; i < n.size(); ++i) {
    const double x = std::log(n[i]), y = std::log(seconds[i]);
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
  }
  const auto count = static_cast<double>(n.size());
  return (count * sum_xy - sum_x * sum_y) / (count * sum_xx - sum_x * sum_x);
}

/// 1, 3, 10, 30 ... times `least`.
std::vector<int>
steps(int least, int most)
{
  std::vector<int> n;
  for (int decade = least; decade <= most; decade *= 10) {
    n.push_back(decade);
    if (3 * decade <= most)
      n.push_back(3 * decade);
  }
  return n;
}

constexpr int kQueries = 20000;

double
gridQueries(const Points& points, const BallGrid& grid, std::size_t& found)
{
  std::vector<int> indices;
  const double start = processorSeconds();
  for (int i = 0; i < kQueries; ++i) {
    grid.search(points[i * (static_cast<int>(points.size()) / kQueries)],
                kRadius,
                indices);
    found += indices.size();
  }
  return 1e6 * (processorSeconds() - start) / kQueries;
}

double
treeQueries(const Points& points,
            const pcl::KdTreeFLANN<pcl::PointXYZ>& tree,
            std::size_t& found)
{
  pcl::Indices indices;
  std::vector<float> distances;
  const double start = processorSeconds();
  for (int i = 0; i < kQueries; ++i) {
    tree.radiusSearch(points[i * (static_cast<int>(points.size()) / kQueries)],
                      kRadius,
                      indices,
                      distances);
    std::sort(indices.begin(), indices.end()); // as neighbourhoods are
    found += indices.size();
  }
  return 1e6 * (processorSeconds() - start) / kQueries;
}

/// The search alone, beside FLANN's.
void
compareBalls(int most)
{
  std::printf("balls: %.0f mm, sorted by index\n", 1e3 * kRadius);
  std::printf("%10s %6s %9s %12s %10s %8s\n",
              "points",
              "by",
              "build s",
              "of the cloud",
              "us a ball",
              "points");
  for (const int n : steps(100000, most)) {
    const Points::Ptr points = survey(n);
    const double cloud_mb = 16e-6 * n;
    std::vector<int> all(points->size());
    std::iota(all.begin(), all.end(), 0);
    std::size_t found = 0;
    std::unique_ptr<BallGrid> grid;
    const Cost built =
        costOf([&] { grid = std::make_unique<BallGrid>(*points, all, kRadius); });
    const double grid_us = gridQueries(*points, *grid, found);
    grid.reset();
    std::printf("%10d %6s %9.3f %12.2f %10.2f %8.1f\n",
                n,
                "grid",
                built.seconds,
                built.megabytes / cloud_mb,
                grid_us,
                static_cast<double>(found) / kQueries);
    found = 0;
    pcl::KdTreeFLANN<pcl::PointXYZ> tree(false);
    const Cost grown = costOf([&] { tree.setInputCloud(points); });
    const double tree_us = treeQueries(*points, tree, found);
    std::printf("%10d %6s %9.3f %12.2f %10.2f %8.1f\n",
                n,
                "flann",
                grown.seconds,
                grown.megabytes / cloud_mb,
                tree_us,
                static_cast<double>(found) / kQueries);
  }
}

Sensor
scanner()
{
  Sensor sensor;
  sensor.name = "scanner";
  sensor.noise = std::make_shared<ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{0.003, 0.003});
  return sensor;
}

ExtractionOptions
extractionOptions()
{
  ExtractionOptions options;
  options.sampler.radius_m = kRadius;
  options.sampler.spacing_m = 0.4;
  options.threads = 1;
  return options;
}

/// As many seeds per square metre in all clouds.
void
growPoints(int most)
{
  std::printf("\nextractPatches: a seed every 0.4 m\n");
  std::printf("%10s %9s %10s %22s\n",
              "points",
              "patches",
              "s",
              "memory with the cloud");
  std::vector<double> sizes, seconds;
  for (const int n : steps(100000, most)) {
    RangeCloud cloud;
    cloud.points = survey(n);
    std::size_t patches = 0;
    const Cost cost = costOf([&] {
      const auto result = extractPatches(cloud, scanner(), extractionOptions());
      patches = result.patches.size();
    });
    sizes.push_back(n);
    seconds.push_back(cost.seconds);
    const double cloud_mb = 16e-6 * n;
    std::printf("%10d %9zu %9.3f %15.2f clouds %9.2f clouds\n",
                n,
                patches,
                cost.seconds,
                1.0 + cost.megabytes / cloud_mb,
                1e-6 * static_cast<double>(patches * sizeof(ExtractedPatch)) /
                    cloud_mb);
  }
  std::printf("exponent of the time in points: %.3f\n", exponent(sizes, seconds));
}

/// One cloud; less the time it takes without patches to speak of.
void
growPatches(int most)
{
  RangeCloud cloud;
  cloud.points = survey(std::min(most, 3000000));
  const auto secondsFor = [&](int seeds, std::size_t& patches) {
    ExtractionOptions options = extractionOptions();
    options.sampler.strategy = SeedStrategy::Random;
    options.sampler.max_seeds = seeds;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const Cost cost = costOf(
          [&] { patches = extractPatches(cloud, scanner(), options).patches.size(); });
      least = std::min(least, cost.seconds);
    }
    return least;
  };
  std::size_t patches = 0;
  const double without = secondsFor(1, patches);
  std::printf("\nextractPatches of %zu points, beyond the %.3f s of a single seed\n",
              cloud.points->size(),
              without);
  std::printf("%10s %9s %10s\n", "seeds", "patches", "s");
  std::vector<double> sizes, seconds;
  for (const int seeds : steps(10000, 100000)) {
    const double beyond = secondsFor(seeds, patches) - without;
    sizes.push_back(static_cast<double>(patches));
    seconds.push_back(beyond);
    std::printf("%10d %9zu %10.3f\n", seeds, patches, beyond);
  }
  std::printf("exponent of the time in patches: %.3f\n", exponent(sizes, seconds));
}

}} // namespace holdfast::benchmarks

int
main(int argc, char** argv)
{
  const int most = argc > 1 ? std::atoi(argv[1]) : 10000000;
  if (argc > 2 || most < 100000) {
    std::fprintf(stderr, "usage: holdfast_scale_benchmark [MOST_POINTS >= 100000]\n");
    return 2;
  }
  holdfast::benchmarks::compareBalls(most);
  holdfast::benchmarks::growPoints(most);
  holdfast::benchmarks::growPatches(most);
  return 0;
}
