#include "support/random.h"

#include "pcl/seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast { namespace {

using test::Random;

constexpr double kNearest = 0.8, kFarthest = 2.4; // m

/// Walls at random depths beside each other, with holes.
PixelGrid
makeGrid(Random& random)
{
  PixelGrid grid;
  Camera& camera = grid.camera;
  camera.width = 80;
  camera.height = 60;
  camera.fx = camera.fy = 70.0;
  camera.cx = 39.5;
  camera.cy = 29.5;
  double wall = kNearest;
  for (int i = 0; i < camera.width * camera.height; ++i) {
    if (random.uniform(0.0, 1.0) < 0.05)
      wall = random.uniform(kNearest + 0.1, kFarthest);
    const bool is_hole = random.uniform(0.0, 1.0) < 0.1;
    grid.depth.push_back(is_hole ? std::numeric_limits<float>::quiet_NaN() :
                                   static_cast<float>(wall));
  }
  grid.depth[0] = static_cast<float>(kNearest);
  return grid;
}

Eigen::Vector3d
pointAt(const PixelGrid& grid, int pixel)
{
  const Camera& camera = grid.camera;
  const int u = pixel % camera.width, v = pixel / camera.width;
  return grid.row(v)[u] *
         Eigen::Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
}

/// Every pixel of the rows against all seeds before; what lies d from the first that is
/// nearer than the spacing is passed over by spacing - d, a quarter of it at least.
std::vector<int>
seedsOneByOne(const PixelGrid& grid, double spacing)
{
  const Camera& camera = grid.camera;
  std::vector<int> seeds;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width;) {
      const int pixel = v * camera.width + u;
      const double depth = grid.row(v)[u];
      if (std::isnan(depth)) {
        ++u;
        continue;
      }
      const auto distance = [&](int seed) {
        return (pointAt(grid, seed) - pointAt(grid, pixel)).norm();
      };
      const auto near = std::find_if(seeds.begin(), seeds.end(), [&](int seed) {
        return distance(seed) < spacing;
      });
      const double blocked = near == seeds.end() ? 0.0 : distance(*near);
      if (near == seeds.end())
        seeds.push_back(pixel);
      const double free = std::max(0.25 * spacing, spacing - blocked);
      u += std::max(1, static_cast<int>(free * camera.fx / depth));
    }
  return seeds;
}

TEST(PixelGridSeeds, AreThoseOfALookAtAllSeedsBefore)
{
  Random random;
  for (int trial = 0; trial < 20; ++trial) {
    const PixelGrid grid = makeGrid(random);
    // Less than eight pixels at the nearest: every row is looked at, and cells of the
    // search are pixels.
    const double pixel = kNearest / grid.camera.fx;
    const double spacing = random.uniform(1.0, 7.9) * pixel;
    EXPECT_EQ(pixelGridSeeds(grid, spacing, 0), seedsOneByOne(grid, spacing));
  }
}

TEST(PixelGridSeeds, AreASpacingApartAtEveryScale)
{
  Random random;
  for (int trial = 0; trial < 20; ++trial) {
    const PixelGrid grid = makeGrid(random);
    const double spacing = random.uniform(0.01, 1.5); // up to beyond the nearest point
    const std::vector<int> seeds = pixelGridSeeds(grid, spacing, 0);
    ASSERT_FALSE(seeds.empty());
    for (std::size_t i = 0; i < seeds.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GE((pointAt(grid, seeds[i]) - pointAt(grid, seeds[j])).norm(), spacing);
  }
}

TEST(PixelGridSeeds, NoneWithoutPoints)
{
  Random random;
  PixelGrid grid = makeGrid(random);
  std::fill(grid.depth.begin(),
            grid.depth.end(),
            std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(pixelGridSeeds(grid, 0.05, 0).empty());
}

}} // namespace holdfast
