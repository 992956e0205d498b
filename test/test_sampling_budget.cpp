#include "support/organized_cloud.h"
#include "support/random.h"

#include "pcl/sampling_budget.h"
#include <holdfast/geometry/constants.h>

#include <set>
#include <stdexcept>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;

SamplerOptions
areaLimit(double area_m2)
{
  SamplerOptions options;
  options.max_area_m2 = area_m2;
  return options;
}

TEST(SamplingBudget, CountsEachPointOnce)
{
  SamplingBudget budget(areaLimit(3.5), 10);
  budget.cover({0, 1, 2, 3}, 2.0);
  EXPECT_EQ(budget.coveredArea(), 2.0);
  budget.cover({3, 2, 1, 0}, 2.0);
  EXPECT_EQ(budget.coveredArea(), 2.0);
  budget.cover({}, 2.0);
  EXPECT_EQ(budget.coveredArea(), 2.0);
  EXPECT_FALSE(budget.isFull());
  budget.cover({2, 3, 4, 5}, 3.0); // half of it is new
  EXPECT_EQ(budget.coveredArea(), 3.5);
  EXPECT_TRUE(budget.isSpent());
  EXPECT_THROW(budget.cover({10}, 1.0), std::out_of_range);
}

TEST(SamplingBudget, CountsPatches)
{
  SamplerOptions options;
  options.max_patches = 2;
  EXPECT_TRUE(isLimited(options));
  SamplingBudget budget(options, 3);
  budget.cover({0, 1}, 1.0);
  EXPECT_FALSE(budget.isFull());
  budget.cover({0, 1}, 1.0);
  EXPECT_TRUE(budget.isFull());
  EXPECT_TRUE(budget.isSpent());
}

TEST(SamplingBudget, IsNeverSpentWithoutLimits)
{
  EXPECT_FALSE(isLimited({}));
  SamplingBudget budget({}, 1);
  budget.cover({0}, 1e9);
  EXPECT_FALSE(budget.isSpent());
}

TEST(SamplingBudget, IsSpentWhenTheTimeIsOver)
{
  SamplerOptions options;
  options.max_time_s = 1e-6;
  EXPECT_TRUE(isLimited(options));
  const SamplingBudget budget(options, 0);
  while (!budget.isSpent()) {}
  options.max_time_s = 1e9;
  EXPECT_FALSE(SamplingBudget(options, 0).isSpent());
}

/// A wall at 1 m, 160 x 120 pixels of 1 / 150 m.
TEST(SamplingBudget, CoversTheShareOfAWallThatWasAskedFor)
{
  const Camera camera = makeCamera(160, 120, 150.0);
  const RangeCloud cloud = makeOrganizedCloud(camera, [](int, int) { return 1.0; });
  const double wall = 160.0 * 120.0 / (150.0 * 150.0);
  SamplerOptions options = areaLimit(0.5 * wall);
  options.radius_m = 0.06;
  options.spacing_m = 0.04;
  const NeighborhoodSampler sampler(cloud, makeSensor(camera), options);
  const auto scratch = sampler.makeScratch();
  SamplingBudget budget(sampler.options(), cloud.points->size());
  std::set<int> seen;
  std::vector<int> indices;
  for (const int seed : sampler.seeds()) {
    if (budget.isSpent())
      break;
    sampler.neighborhood(seed, *scratch, indices);
    budget.cover(indices, kPi * options.radius_m * options.radius_m);
    seen.insert(indices.begin(), indices.end());
  }
  EXPECT_TRUE(budget.isSpent());
  // Discs that the edge of the image cuts count too much: an edge of one radius is a
  // sixth of the area, and of it half is missing.
  EXPECT_NEAR(static_cast<double>(seen.size()) / (160.0 * 120.0), 0.5, 0.06);
  // They lie all over the wall.
  std::set<int> quarters;
  for (const int index : seen)
    quarters.insert(index % 160 / 80 + 2 * (index / 160 / 60));
  EXPECT_EQ(quarters.size(), 4U);
}

TEST(SamplingBudget, AGridKeepsItsSeeds)
{
  Random random;
  const Camera camera = makeCamera(160, 120, 150.0);
  const RangeCloud cloud = makeOrganizedCloud(camera, [&random](int, int) {
    return random.uniform(0.9, 1.1);
  });
  const std::vector<int> grid =
      NeighborhoodSampler(cloud, makeSensor(camera), {}).seeds();
  std::vector<int> shuffled =
      NeighborhoodSampler(cloud, makeSensor(camera), areaLimit(1.0)).seeds();
  EXPECT_NE(shuffled, grid);
  std::sort(shuffled.begin(), shuffled.end());
  EXPECT_EQ(shuffled, grid);
}

}} // namespace holdfast
