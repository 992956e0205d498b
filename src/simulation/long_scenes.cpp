/// Scenes to walk through.
#include "portable_random.h"
#include "scene_parts.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace holdfast {

namespace {

using Eigen::Vector3d;

/// Where a rock lies and how large it is.
struct Spot {
  double x, y, radius;
};

/// Rocks may touch and lean on each other, but not vanish in each other.
bool
isFree(const Spot& spot, const std::vector<Spot>& taken)
{
  constexpr double kOverlap = 0.85;
  return std::none_of(taken.begin(), taken.end(), [&](const Spot& other) {
    const Vector3d between(spot.x - other.x, spot.y - other.y, 0.0);
    return between.norm() < kOverlap * (spot.radius + other.radius);
  });
}

/// Spots on a rectangle about the origin, the large ones first, as those fit between
/// small ones no more.
std::vector<Spot>
scatter(int count, double length, double width, std::mt19937_64& generator)
{
  constexpr double kLargest = 0.30, kSmallest = 0.07;
  std::vector<Spot> spots;
  while (static_cast<int>(spots.size()) < count) {
    const double share = static_cast<double>(spots.size()) / count;
    const double radius = kLargest * std::pow(kSmallest / kLargest, share);
    const double x = uniform(generator, -0.5 * length, 0.5 * length);
    const double y = uniform(generator, -0.5 * width, 0.5 * width);
    if (const Spot spot{x, y, radius}; isFree(spot, spots))
      spots.push_back(spot);
  }
  return spots;
}

} // namespace

void
makeBoulderField(Scene& scene, double distance)
{
  constexpr double kLength = 12.0, kWidth = 3.0;
  constexpr int kRocks = 170;
  const auto ground =
      std::make_shared<Terrain>(Vector3d::Zero(), 20.0, 0.05, 2.0, std::uint64_t{21});
  std::mt19937_64 generator(22);
  std::uint64_t seed = 100;
  for (const Spot& spot : scatter(kRocks, kLength, kWidth, generator)) {
    const double across = uniform(generator, 0.7, 0.95);
    const double up = uniform(generator, 0.6, 1.0);
    addBoulder(scene,
               *ground,
               spot.x,
               spot.y,
               spot.radius * Vector3d(1.0, across, up),
               ++seed);
  }
  // Last: it takes the longest, and is not looked for behind a rock.
  scene.shapes.push_back(ground);
  scene.walk_start = {-6.5, 0.0, 0.0};
  placeSensor(scene, {0, 0, 0.05}, distance);
}

void
makeStairway(Scene& scene, double distance)
{
  constexpr double kRise = 0.15, kRun = 0.28, kWidth = 1.6, kLanding = 1.2;
  constexpr int kSteps = 10;
  addFloor(scene, 20.0);
  const auto add = [&](double x, double length, double height) {
    addStandingBox(scene, {x, 0.0, 0.0}, {length, kWidth, height}, 0.0);
  };
  for (int step = 1; step < kSteps; ++step) {
    const double x = 0.5 * kLanding + (kSteps - step - 0.5) * kRun;
    add(-x, kRun, step * kRise);
    add(x, kRun, step * kRise);
  }
  add(0.0, kLanding, kSteps * kRise);
  scene.walk_start = {-4.8, 0.0, 0.0};
  placeSensor(scene, {-0.5 * kLanding, 0.0, kSteps * kRise}, distance);
}

} // namespace holdfast
