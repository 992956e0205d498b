// Clouds of the same size, one after another: what a patch needs was taken for the
// first.
#include "support/count_allocations.h"
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/frame_extraction.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/pcl/patch_estimation.h>

#include <utility>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;

const Camera kCamera = makeCamera(160, 120, 150.0);

/// Beyond what a call takes whatever the number of its patches.
constexpr long kPerCall = 300;

RangeCloud
rollingCloud(Random& random)
{
  return makeOrganizedCloud(kCamera, [&](int u, int v) {
    return 1.0 + 0.05 * std::sin(0.1 * u) * std::cos(0.1 * v) +
           random.uniform(-0.001, 0.001);
  });
}

class ExtractionAllocation : public testing::Test {
protected:
  void SetUp() override
  {
#ifndef HOLDFAST_COUNTS_ALLOCATIONS
    GTEST_SKIP() << "allocations cannot be counted under a sanitizer";
#endif
  }
};

TEST_F(ExtractionAllocation, APatchTakesNoneFromTheSecondCloudOn)
{
  Random random;
  const RangeCloud cloud = rollingCloud(random);
  ExtractionOptions options;
  options.sampler.spacing_m = 0.02;
  for (const bool keep_failures : {false, true}) {
    options.keep_failures = keep_failures;
    ExtractionResult result = extractPatches(cloud, makeSensor(kCamera), options);
    const std::size_t patches = result.patches.size();
    ASSERT_GT(patches, 3 * kPerCall);
    const long before = test::allocations;
    result = extractPatches(cloud, makeSensor(kCamera), options, {}, std::move(result));
    EXPECT_LT(test::allocations - before, kPerCall);
    EXPECT_EQ(result.patches.size(), patches);
  }
}

TEST_F(ExtractionAllocation, APatchOfAStreamTakesNoneFromTheSecondFrameOn)
{
  Random random;
  ExtractionOptions options;
  options.sampler.max_patches = 2000;
  FrameExtractor extractor(makeSensor(kCamera), options);
  ExtractionResult result;
  for (int frame = 0; frame < 4; ++frame) {
    const RangeCloud cloud = rollingCloud(random);
    const long before = test::allocations;
    result = extractor.extract(cloud, std::move(result));
    ASSERT_GT(result.patches.size(), 3 * kPerCall);
    if (frame > 0) {
      EXPECT_LT(test::allocations - before, kPerCall);
    }
  }
}

TEST_F(ExtractionAllocation, APatchOfTheFeatureTakesNoneFromTheSecondCloudOn)
{
  Random random;
  PatchEstimation<pcl::PointXYZ, PatchPoint> estimation;
  estimation.setSensor(makeSensor(kCamera));
  estimation.setInputCloud(rollingCloud(random).points);
  estimation.setSeedsFromSampler(true);
  SamplerOptions sampler;
  sampler.spacing_m = 0.02;
  estimation.setSamplerOptions(sampler);
  pcl::PointCloud<PatchPoint> patches;
  estimation.compute(patches);
  ASSERT_GT(patches.size(), 3 * kPerCall);
  const std::size_t size = patches.size();
  const long before = test::allocations;
  estimation.compute(patches);
  EXPECT_LT(test::allocations - before, kPerCall);
  EXPECT_EQ(patches.size(), size);
}

TEST_F(ExtractionAllocation, APatchOfAMapTakesNoneFromTheSecondFrameOn)
{
  Random random;
  MappingOptions options;
  options.extraction.sampler.spacing_m = 0.02;
  FrameMapper still(makeSensor(kCamera), options),
      unknown(makeSensor(kCamera), options);
  FrameReport of_still, of_unknown;
  for (int frame = 0; frame < 4; ++frame) {
    const RangeCloud cloud = rollingCloud(random);
    long before = test::allocations;
    of_still = still.addStill(cloud, std::move(of_still));
    const long by_still = test::allocations - before;
    before = test::allocations;
    of_unknown = unknown.addUnknown(cloud, std::move(of_unknown));
    const long by_unknown = test::allocations - before;
    ASSERT_GT(of_still.measurements, 3 * kPerCall);
    ASSERT_GT(of_unknown.measurements, 3 * kPerCall);
    if (frame > 0) {
      EXPECT_LT(by_still, kPerCall);
      EXPECT_LT(by_unknown, kPerCall);
    }
  }
}

/// The former result gives its memory, nothing else.
TEST(ExtractionMemory, OfAnyFormerResultServes)
{
  Random random;
  const RangeCloud cloud = rollingCloud(random);
  const Sensor sensor = makeSensor(kCamera);
  ExtractionOptions options;
  const ExtractionResult fresh = extractPatches(cloud, sensor, options);
  ExtractionOptions others;
  others.sampler.spacing_m = 0.03;
  others.fit.surface = SurfaceRequest::Sphere;
  others.fit.separate_pattern = true;
  others.keep_failures = true;
  const ExtractionResult again =
      extractPatches(cloud, sensor, options, {}, extractPatches(cloud, sensor, others));
  ASSERT_EQ(again.patches.size(), fresh.patches.size());
  EXPECT_EQ(again.rejected, fresh.rejected);
  EXPECT_EQ(again.turned_down, fresh.turned_down);
  EXPECT_EQ(again.notices, fresh.notices);
  EXPECT_EQ(again.second_attempts, fresh.second_attempts);
  for (std::size_t i = 0; i < fresh.patches.size(); ++i) {
    EXPECT_EQ(again.patches[i].seed_index, fresh.patches[i].seed_index);
    EXPECT_EQ(again.patches[i].fit.patch.c, fresh.patches[i].fit.patch.c);
    EXPECT_EQ(again.patches[i].fit.covariance, fresh.patches[i].fit.covariance);
    EXPECT_EQ(again.patches[i].fit.white_state_covariance->size(), 0);
  }
}

}} // namespace holdfast
