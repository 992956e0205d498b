// A point type of a user's own: the impl headers compile our templates for it, and its
// output may be a type of PCL's.
#include "support/small_clouds.h"

#include <holdfast/pcl/impl/patch_estimation.hpp>
#include <holdfast/pcl/impl/range_covariance_estimation.hpp>
#include <holdfast/sensor/constant_noise_model.h>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

struct EIGEN_ALIGN16 HeatPoint {
  PCL_ADD_POINT4D
  float temperature = 0.0F;
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

POINT_CLOUD_REGISTER_POINT_STRUCT(HeatPoint,
                                  (float, x, x)(float, y, y)(float, z, z)(float,
                                                                          temperature,
                                                                          temperature))

namespace holdfast { namespace {

pcl::PointCloud<HeatPoint>::Ptr
heatCloud()
{
  auto cloud = pcl::make_shared<pcl::PointCloud<HeatPoint>>();
  pcl::copyPointCloud(*test::bowlCloud(40, 30).points, *cloud);
  return cloud;
}

const NoiseModel::ConstPtr kNoise =
    std::make_shared<const ConstantNoiseModel>(ConstantNoiseModel::Parameters{});

TEST(CustomPointType, GoesIntoPatchEstimation)
{
  PatchEstimation<HeatPoint, pcl::PointNormal> estimation;
  estimation.setInputCloud(heatCloud());
  estimation.setNoiseModel(kNoise);
  estimation.setIndices(pcl::make_shared<pcl::Indices>(1, 15 * 40 + 20));
  pcl::PointCloud<pcl::PointNormal> patches;
  estimation.setRadiusSearch(0.1);
  estimation.compute(patches); // our neighbourhoods
  ASSERT_EQ(patches.size(), 1U);
  EXPECT_LT(patches[0].normal_z, -0.9F);
  estimation.setSearchMethod(pcl::make_shared<pcl::search::KdTree<HeatPoint>>());
  estimation.compute(patches); // PCL's
  ASSERT_EQ(patches.size(), 1U);
  EXPECT_LT(patches[0].normal_z, -0.9F);
}

TEST(CustomPointType, GoesIntoRangeCovarianceEstimation)
{
  RangeCovarianceEstimation<HeatPoint> estimation;
  estimation.setInputCloud(heatCloud());
  estimation.setNoiseModel(kNoise);
  pcl::PointCloud<PointXYZCovariance> points;
  estimation.compute(points);
  ASSERT_EQ(points.size(), 40U * 30U);
  EXPECT_FLOAT_EQ(points[100].covariance[0], 1e-6F);
}

}} // namespace holdfast
