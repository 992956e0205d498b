// The extent, spacing and validity of clouds that are known.
#include "pcl/cloud_measure.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast { namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using test::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A sheet of 60 x 40 points, `step` apart, at z = 50 steps.
Cloud
sheet(float step)
{
  Cloud cloud(60, 40);
  for (int v = 0; v < 40; ++v)
    for (int u = 0; u < 60; ++u)
      cloud(u, v) = {step * static_cast<float>(u),
                     step * static_cast<float>(v),
                     50.0F * step};
  return cloud;
}

Cloud
shuffled(Cloud cloud, Random& random)
{
  std::shuffle(cloud.begin(), cloud.end(), random.engine());
  cloud.width = static_cast<std::uint32_t>(cloud.size());
  cloud.height = 1;
  return cloud;
}

TEST(CloudMeasure, IsThatOfTheSheetInAnyUnitAndOrder)
{
  Random random;
  for (const float step : {1e-3F, 0.1F, 7.0F})
    for (const Cloud& cloud : {sheet(step), shuffled(sheet(step), random)}) {
      const CloudMeasure measure = measureCloud(cloud);
      EXPECT_EQ(measure.points, 2400U);
      EXPECT_EQ(measure.valid, 2400U);
      EXPECT_EQ(measure.organized, cloud.height > 1);
      EXPECT_NEAR(measure.spacing_m, step, 1e-4 * step);
      EXPECT_NEAR(measure.extent(), 59.0 * step, 1e-4 * step);
      EXPECT_NEAR(measure.low.z(), 50.0 * step, 1e-4 * step);
      // Between the nearest corner and the farthest.
      EXPECT_GT(measure.range_m, 50.0 * step);
      EXPECT_LT(measure.range_m, 87.0 * step);
    }
}

TEST(CloudMeasure, SaysHowManyPointsAreValid)
{
  Random random;
  Cloud cloud = sheet(0.01F);
  for (std::size_t i = 0; i < cloud.size(); i += 3)
    cloud[i].z = kNan;
  cloud.is_dense = false;
  for (const Cloud& some : {cloud, shuffled(cloud, random)}) {
    const CloudMeasure measure = measureCloud(some);
    EXPECT_EQ(measure.valid, 1600U);
    EXPECT_NEAR(measure.spacing_m, 0.01, 1e-5);
  }
}

TEST(CloudMeasure, CountsCopiesAsOnePlace)
{
  Random random;
  Cloud cloud = shuffled(sheet(0.01F), random);
  const Cloud once = cloud;
  cloud += once;
  EXPECT_NEAR(measureCloud(cloud).spacing_m, 0.01, 1e-5);
}

TEST(CloudMeasure, HasNoSpacingWithoutTwoPlaces)
{
  EXPECT_TRUE(std::isnan(measureCloud({}).spacing_m));
  Cloud cloud;
  cloud.resize(100, {kNan, kNan, kNan});
  EXPECT_EQ(measureCloud(cloud).valid, 0U);
  EXPECT_TRUE(std::isnan(measureCloud(cloud).spacing_m));
  EXPECT_EQ(describe(measureCloud(cloud)), "0 of 100 points are valid");
  cloud[3] = {1.0F, 2.0F, 3.0F};
  cloud[7] = {1.0F, 2.0F, 3.0F};
  EXPECT_EQ(measureCloud(cloud).valid, 2U);
  EXPECT_TRUE(std::isnan(measureCloud(cloud).spacing_m));
  EXPECT_EQ(measureCloud(cloud).extent(), 0.0);
}

TEST(CloudMeasure, IsSaidInWords)
{
  EXPECT_EQ(describe(measureCloud(sheet(0.01F))),
            "2400 of 2400 points are valid, over 0.59 x 0.39 x 0 m, 0.01 m apart");
  EXPECT_EQ(shortNumber(1520.4), "1520");
  EXPECT_EQ(shortNumber(0.003512), "0.00351");
}

}} // namespace holdfast
