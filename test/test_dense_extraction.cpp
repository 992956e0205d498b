#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/dense_extraction.h>

#include <cmath>
#include <stdexcept>
#include <utility>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;

const Camera kCamera = makeCamera(90, 61, 100.0);

/// Rolling ground before a far wall, with holes.
RangeCloud
makeCloud(Random& random)
{
  return makeOrganizedCloud(kCamera, [&](int u, int v) {
    if (random.uniform(0.0, 1.0) < 0.05)
      return std::nan("");
    const double wall = u > 60 ? 0.7 : 0.0;
    return 1.0 + wall + 0.05 * std::sin(0.1 * u) * std::cos(0.1 * v) +
           0.002 * random.normal();
  });
}

ExtractionOptions
makeOptions()
{
  ExtractionOptions options;
  options.sampler.radius_m = 0.06;
  options.threads = 1;
  return options;
}

/// Bit for bit.
void
expectSame(const ExtractedPatch& a, const ExtractedPatch& b)
{
  EXPECT_EQ(a.seed_index, b.seed_index);
  EXPECT_EQ(a.is_second_attempt, b.is_second_attempt);
  EXPECT_EQ(a.fit.status, b.fit.status);
  EXPECT_EQ(a.fit.points, b.fit.points);
  EXPECT_EQ(a.fit.chi2, b.fit.chi2);
  EXPECT_EQ(a.fit.patch.type, b.fit.patch.type);
  EXPECT_EQ(a.fit.patch.d, b.fit.patch.d);
  EXPECT_EQ(a.fit.patch.kappa, b.fit.patch.kappa);
  EXPECT_EQ(a.fit.patch.r, b.fit.patch.r);
  EXPECT_EQ(a.fit.patch.c, b.fit.patch.c);
  EXPECT_EQ(a.fit.covariance, b.fit.covariance);
  EXPECT_EQ(a.fit.state_covariance, b.fit.state_covariance);
  ASSERT_EQ(a.validation.has_value(), b.validation.has_value());
  EXPECT_EQ(a.validation->verdict, b.validation->verdict);
  EXPECT_EQ(a.validation->coverage.share, b.validation->coverage.share);
  EXPECT_EQ(a.validation->residual.rms_m, b.validation->residual.rms_m);
}

TEST(DenseExtraction, HasAnAttemptAtEveryPlace)
{
  Random random;
  const RangeCloud cloud = makeCloud(random);
  for (const int stride : {1, 2, 7, 61}) {
    ExtractionOptions options = makeOptions();
    options.sampler.radius_m = stride == 1 ? 0.03 : 0.06;
    const DenseExtraction dense =
        extractDense(cloud, makeSensor(kCamera), options, stride);
    ASSERT_EQ(dense.result.patches.size(),
              static_cast<std::size_t>(dense.width * dense.height));
    for (int row = 0; row < dense.height; ++row)
      for (int column = 0; column < dense.width; ++column) {
        const int u = column * stride + stride / 2, v = row * stride + stride / 2;
        ASSERT_LT(u, kCamera.width);
        ASSERT_LT(v, kCamera.height);
        EXPECT_EQ(
            dense.result.patches[static_cast<std::size_t>(row * dense.width + column)]
                .seed_index,
            v * kCamera.width + u);
      }
    // No further place would have had a pixel.
    EXPECT_GE(dense.width * stride + stride / 2, kCamera.width);
    EXPECT_GE(dense.height * stride + stride / 2, kCamera.height);
  }
}

TEST(DenseExtraction, IsThePatchOfEachPixelAlone)
{
  Random random;
  const RangeCloud cloud = makeCloud(random);
  const Sensor sensor = makeSensor(kCamera);
  ExtractionOptions options = makeOptions();
  const DenseExtraction dense = extractDense(cloud, sensor, options, 6);
  ASSERT_GT(dense.result.patches.size(), 100U);
  EXPECT_FALSE(dense.result.turned_down.empty());
  EXPECT_FALSE(dense.result.rejected.empty());
  options.keep_failures = true;
  for (const ExtractedPatch& patch : dense.result.patches) {
    PatchSites site;
    site.seeds = seedsAt(cloud, {*patch.seed_index});
    const ExtractionResult alone = extractPatches(cloud, sensor, options, site);
    ASSERT_EQ(alone.patches.size(), 1U);
    expectSame(patch, alone.patches[0]);
  }
}

TEST(DenseExtraction, DependsNeitherOnThreadsNorOnAFormerOne)
{
  Random random;
  const RangeCloud cloud = makeCloud(random);
  const Sensor sensor = makeSensor(kCamera);
  ExtractionOptions options = makeOptions();
  const DenseExtraction one = extractDense(cloud, sensor, options, 4);
  options.threads = 2;
  DenseExtraction former = extractDense(cloud, sensor, options, 3);
  const DenseExtraction two =
      extractDense(cloud, sensor, options, 4, std::move(former));
  EXPECT_EQ(two.width, one.width);
  EXPECT_EQ(two.height, one.height);
  EXPECT_EQ(two.result.rejected, one.result.rejected);
  EXPECT_EQ(two.result.turned_down, one.result.turned_down);
  ASSERT_EQ(two.result.patches.size(), one.result.patches.size());
  for (std::size_t i = 0; i < one.result.patches.size(); ++i)
    expectSame(one.result.patches[i], two.result.patches[i]);
}

TEST(DenseExtraction, IsAnOrganizedCloudThatKeepsTheStatus)
{
  Random random;
  const RangeCloud cloud = makeCloud(random);
  const DenseExtraction dense =
      extractDense(cloud, makeSensor(kCamera), makeOptions(), 5);
  const pcl::PointCloud<PatchPoint> points = toPatchCloud(dense, cloud.sensor_pose);
  EXPECT_EQ(points.width, static_cast<std::uint32_t>(dense.width));
  EXPECT_EQ(points.height, static_cast<std::uint32_t>(dense.height));
  int patches = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ExtractedPatch& patch = dense.result.patches[i];
    patches += isAccepted(patch);
    EXPECT_EQ(std::isnan(points[i].x), !isAccepted(patch));
    EXPECT_EQ(points[i].status, static_cast<std::uint8_t>(patch.fit.status));
    EXPECT_EQ(points[i].seed, *patch.seed_index);
  }
  EXPECT_GT(patches, 0);
  EXPECT_FALSE(points.is_dense);
}

TEST(DenseExtraction, MisuseThrows)
{
  Random random;
  const RangeCloud cloud = makeCloud(random);
  const Sensor sensor = makeSensor(kCamera);
  const ExtractionOptions options = makeOptions();
  const auto expectThrow = [&](const RangeCloud& c, const ExtractionOptions& o, int s) {
    EXPECT_FALSE(validityError(c, o, s).empty());
    EXPECT_THROW(extractDense(c, sensor, o, s), std::invalid_argument);
  };
  EXPECT_TRUE(validityError(cloud, options, 1).empty());
  expectThrow(cloud, options, 0);
  expectThrow(cloud, options, -2);
  expectThrow(cloud, options, 2 * kCamera.width);
  for (double SamplerOptions::*limit :
       {&SamplerOptions::max_area_m2, &SamplerOptions::max_time_s}) {
    ExtractionOptions limited = options;
    limited.sampler.*limit = 1.0;
    expectThrow(cloud, limited, 4);
  }
  ExtractionOptions few = options;
  few.sampler.max_patches = 3;
  expectThrow(cloud, few, 4);
  ExtractionOptions thinned = options;
  thinned.max_overlap = 0.5;
  expectThrow(cloud, thinned, 4);
  auto row = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  row->width *= row->height;
  row->height = 1;
  expectThrow({row, {}, {}}, options, 4);
}

}} // namespace holdfast
