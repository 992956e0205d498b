#include "support/extraction_seeds.h"
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/frame_extraction.h>

#include <algorithm>
#include <set>
#include <stdexcept>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;
using test::seedsOf;

const Camera kCamera = makeCamera(160, 120, 150.0);

/// A wall with the noise of the sensor, and nothing left of column `hole`.
RangeCloud
makeWall(Random& random, int hole = 0)
{
  return makeOrganizedCloud(kCamera, [&random, hole](int u, int) {
    return u < hole ? std::nan("") : 1.0 + 0.003 * random.normal();
  });
}

ExtractionOptions
makeOptions(int max_patches)
{
  ExtractionOptions options;
  options.sampler.radius_m = 0.06;
  options.sampler.max_patches = max_patches;
  options.threads = 1;
  return options;
}

TEST(FrameExtractor, KeepsTheSeedsOfASceneThatStays)
{
  Random random;
  FrameExtractor extractor(makeSensor(kCamera), makeOptions(20));
  const std::vector<int> first = seedsOf(extractor.extract(makeWall(random)));
  ASSERT_EQ(first.size(), 20U);
  std::set<int> quarters;
  for (const int seed : first)
    quarters.insert(seed % 160 / 80 + 2 * (seed / 160 / 60));
  EXPECT_EQ(quarters.size(), 4U); // all over the image
  for (int frame = 0; frame < 3; ++frame)
    EXPECT_EQ(seedsOf(extractor.extract(makeWall(random))), first);
}

TEST(FrameExtractor, ReplacesSeedsThatHaveLostTheirPoints)
{
  Random random;
  FrameExtractor extractor(makeSensor(kCamera), makeOptions(20));
  const std::vector<int> whole = seedsOf(extractor.extract(makeWall(random)));
  const std::vector<int> half = seedsOf(extractor.extract(makeWall(random, 80)));
  ASSERT_EQ(half.size(), 20U);
  // The good ones stay in their order, in front.
  std::vector<int> kept;
  for (const int seed : whole)
    if (seed % 160 >= 80)
      kept.push_back(seed);
  ASSERT_LT(kept.size(), whole.size());
  EXPECT_TRUE(std::equal(kept.begin(), kept.end(), half.begin()));
  for (const int seed : half)
    EXPECT_GE(seed % 160, 80);
  // Nothing that was found is lost when the other half comes back.
  EXPECT_EQ(seedsOf(extractor.extract(makeWall(random))), half);
}

TEST(FrameExtractor, TriesAllSeedsWhenFewAreGood)
{
  Random random;
  const ExtractionOptions options = makeOptions(20);
  FrameExtractor extractor(makeSensor(kCamera), options);
  const ExtractionResult result = extractor.extract(makeWall(random, 140));
  EXPECT_LT(result.patches.size(), 20U);
  EXPECT_GT(result.patches.size(), 3U);
  int rejected = 0;
  for (const auto& [status, count] : result.rejected)
    rejected += count;
  // About three seeds for each patch: a square grid does not take every number.
  EXPECT_NEAR(rejected + static_cast<int>(result.patches.size()), 60, 10);
}

TEST(FrameExtractor, DoesNotDependOnThreads)
{
  const auto run = [](int threads) {
    Random random;
    ExtractionOptions options = makeOptions(20);
    options.threads = threads;
    FrameExtractor extractor(makeSensor(kCamera), options);
    std::vector<int> seeds;
    for (const int hole : {0, 80, 20, 0})
      for (const int seed : seedsOf(extractor.extract(makeWall(random, hole))))
        seeds.push_back(seed);
    return seeds;
  };
  EXPECT_EQ(run(1), run(3));
}

TEST(FrameExtractor, TakesAFrameOfAnotherSize)
{
  Random random;
  FrameExtractor extractor(makeSensor(kCamera), makeOptions(20));
  extractor.extract(makeWall(random));
  const RangeCloud small =
      makeOrganizedCloud(makeCamera(80, 60, 75.0),
                         [&random](int, int) { return 1.0 + 0.003 * random.normal(); });
  EXPECT_EQ(extractor.extract(small).patches.size(), 20U);
}

TEST(FrameExtractor, AFrameWithoutPointsHasNoPatches)
{
  Random random;
  FrameExtractor extractor(makeSensor(kCamera), makeOptions(20));
  EXPECT_TRUE(extractor.extract(makeWall(random, 160)).patches.empty());
  EXPECT_EQ(extractor.extract(makeWall(random)).patches.size(), 20U);
}

TEST(FrameExtractor, MisuseThrows)
{
  const Sensor sensor = makeSensor(kCamera);
  EXPECT_THROW(FrameExtractor(sensor, {}), std::invalid_argument);
  EXPECT_THROW(FrameExtractor(sensor, makeOptions(-1)), std::invalid_argument);
  Random random;
  RangeCloud cloud = makeWall(random);
  auto flat = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  flat->width = static_cast<std::uint32_t>(flat->size());
  flat->height = 1;
  cloud.points = flat;
  FrameExtractor extractor(sensor, makeOptions(5));
  EXPECT_THROW(extractor.extract(cloud), std::invalid_argument);
  EXPECT_THROW(extractor.extract({}), std::invalid_argument);
}

}} // namespace holdfast
