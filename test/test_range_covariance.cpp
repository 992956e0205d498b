#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/range_covariance_estimation.h>
#include <holdfast/sensor/constant_noise_model.h>
#include <holdfast/sensor/dryanovski_noise_model.h>
#include <holdfast/sensor/noise_registry.h>

#include <pcl/common/point_tests.h>

#include <gtest/gtest.h>

#include <memory>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;

const Camera kCamera = makeCamera(32, 24, 30.0);

/// A tilted plane with some holes, as a cloud of the type that knows its sensor pose.
template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr
makeCloud(Random& random, const Pose& pose)
{
  const RangeCloud range = makeOrganizedCloud(
      kCamera,
      [&random](int u, int v) {
        return random.uniform(0.0, 1.0) < 0.05 ? std::nan("") :
                                                 1.0 + 0.01 * u + 0.02 * v;
      },
      pose);
  auto cloud = pcl::make_shared<pcl::PointCloud<PointT>>();
  pcl::copyPointCloud(*range.points, *cloud);
  writeSensorPose(pose, *cloud);
  return cloud;
}

Pose
randomPose(Random& random)
{
  return {random.rotation(), random.uniformVector(-1.0, 1.0)};
}

/// Largest difference of two covariances relative to the largest entry.
double
relativeDifference(const Eigen::Matrix3f& a, const Eigen::Matrix3d& b)
{
  return (a.cast<double>() - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

/// Points, covariances and, with a rotation by a quaternion of floats, the sensor pose
/// are rounded to 6e-8 each; the stereo model squares the depth twice.
constexpr double kRounding = 3e-6;

template <typename PointT>
class EveryInput : public testing::Test {};
using InputTypes = testing::Types<pcl::PointXYZ,
                                  pcl::PointXYZI,
                                  pcl::PointXYZRGB,
                                  pcl::PointXYZRGBA,
                                  pcl::PointNormal,
                                  PointXYZCovariance>;
TYPED_TEST_SUITE(EveryInput, InputTypes);

TYPED_TEST(EveryInput, GetsTheCovariancesOfTheModelInTheFrameOfTheCloud)
{
  Random random;
  const Pose pose = randomPose(random);
  const auto cloud = makeCloud<TypeParam>(random, pose);
  const Sensor sensor = makeSensor(kCamera);
  RangeCovarianceEstimation<TypeParam> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(sensor);
  pcl::PointCloud<PointXYZCovariance> output;
  estimation.compute(output);
  ASSERT_EQ(output.width, cloud->width);
  ASSERT_EQ(output.height, cloud->height);
  EXPECT_EQ(output.sensor_origin_, cloud->sensor_origin_);
  EXPECT_FALSE(output.is_dense);
  for (std::size_t i = 0; i < output.size(); ++i) {
    if (!pcl::isFinite((*cloud)[i])) {
      EXPECT_TRUE(std::isnan(output[i].x) && std::isnan(output[i].covariance[0]));
      continue;
    }
    EXPECT_EQ(output[i].getVector3fMap(), (*cloud)[i].getVector3fMap());
    const Eigen::Vector3d q =
        pose.toLocal((*cloud)[i].getVector3fMap().template cast<double>());
    EXPECT_LT(relativeDifference(output[i].getCovarianceMatrix(),
                                 rotateCovariance(pose.R, sensor.noise->covariance(q))),
              kRounding);
  }
}

TEST(RangeCovariances, HonourIndices)
{
  Random random;
  const auto cloud = makeCloud<pcl::PointXYZ>(random, {});
  RangeCovarianceEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(makeSensor(kCamera));
  pcl::PointCloud<PointXYZCovariance> all, some;
  estimation.compute(all);
  const pcl::Indices indices{700, 3, 3, 50};
  estimation.setIndices(pcl::make_shared<pcl::Indices>(indices));
  estimation.compute(some);
  ASSERT_EQ(some.size(), indices.size());
  Covariances beside;
  estimation.computeCovariances(beside);
  ASSERT_EQ(beside.size(), cloud->size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Eigen::Matrix3f expected = all[indices[i]].getCovarianceMatrix();
    EXPECT_EQ(some[i].getCovarianceMatrix(), expected);
    EXPECT_EQ(beside[indices[i]], expected);
  }
  EXPECT_TRUE(beside[4].array().isNaN().all());
}

TEST(RangeCovariances, OfOrganizedCloudsComeFromTheWindowOfTheMixture)
{
  Random random;
  const Pose pose = randomPose(random);
  const auto cloud = makeCloud<pcl::PointXYZ>(random, pose);
  const auto base = makeSensor(kCamera).noise;
  const auto mixture = std::make_shared<const DryanovskiNoiseModel>(base);
  RangeCovarianceEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setNoiseModel(mixture);
  Covariances organized;
  estimation.computeCovariances(organized);

  std::vector<Eigen::Vector3d> image;
  for (const pcl::PointXYZ& p : *cloud)
    image.push_back(pose.toLocal(p.getVector3fMap().cast<double>()));
  const Covariances expected =
      mixture->imageCovariances(image, kCamera.width, kCamera.height);
  for (std::size_t i = 0; i < image.size(); ++i) {
    if (!image[i].allFinite())
      continue;
    const Eigen::Matrix3d S = rotateCovariance(pose.R, expected[i].cast<double>());
    EXPECT_LT(relativeDifference(organized[i], S), kRounding);
  }

  // A single point has no window.
  auto row = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud);
  row->width = static_cast<std::uint32_t>(cloud->size());
  row->height = 1;
  Covariances unorganized, of_base;
  estimation.setInputCloud(row);
  estimation.computeCovariances(unorganized);
  estimation.setNoiseModel(base);
  estimation.computeCovariances(of_base);
  for (std::size_t i = 0; i < row->size(); ++i)
    EXPECT_TRUE(unorganized[i] == of_base[i] || !pcl::isFinite((*row)[i]));
}

TEST(RangeCovariances, BehindTheCameraOnlyOmnidirectionalModelsHave)
{
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->push_back({0.1F, 0.0F, 1.0F});
  cloud->push_back({0.1F, 0.0F, -1.0F});
  RangeCovarianceEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(makeSensor(kCamera));
  Covariances covariances;
  estimation.computeCovariances(covariances);
  EXPECT_TRUE(covariances[0].allFinite());
  EXPECT_TRUE(covariances[1].array().isNaN().all());
  estimation.setNoiseModel(
      std::make_shared<const ConstantNoiseModel>(ConstantNoiseModel::Parameters{}));
  estimation.computeCovariances(covariances);
  EXPECT_TRUE(covariances[1].allFinite());
}

TEST(RangeCovariances, TakeAnotherSensorPoseIfTold)
{
  Random random;
  const auto cloud = makeCloud<pcl::PointXYZ>(random, {});
  const Sensor sensor = makeSensor(kCamera);
  RangeCovarianceEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(sensor);
  const Pose farther{Eigen::Matrix3d::Identity(), {0.0, 0.0, -1.0}};
  estimation.setSensorPose(farther);
  Covariances covariances;
  estimation.computeCovariances(covariances);
  const Eigen::Vector3d q = (*cloud)[100].getVector3fMap().cast<double>();
  EXPECT_LT(relativeDifference(covariances[100],
                               sensor.noise->covariance(farther.toLocal(q))),
            kRounding);
}

TEST(RangeCovariances, ReportMisuseThePclWay)
{
  Random random;
  const auto cloud = makeCloud<pcl::PointXYZ>(random, {});
  const auto expectEmpty = [](RangeCovarianceEstimation<pcl::PointXYZ>& estimation) {
    pcl::PointCloud<PointXYZCovariance> output(3, 2);
    estimation.compute(output);
    EXPECT_TRUE(output.empty());
    EXPECT_EQ(output.width, 0U);
    Covariances covariances(1);
    estimation.computeCovariances(covariances);
    EXPECT_TRUE(covariances.empty());
  };
  RangeCovarianceEstimation<pcl::PointXYZ> estimation;
  expectEmpty(estimation); // no input
  estimation.setInputCloud(cloud);
  expectEmpty(estimation); // no model
  estimation.setSensor(makeSensor(kCamera));
  for (const int outside : {-1, 32 * 24}) {
    estimation.setIndices(pcl::make_shared<pcl::Indices>(1, outside));
    expectEmpty(estimation);
  }
  RangeCovarianceEstimation<pcl::PointXYZ> other;
  other.setSensor(makeSensor(kCamera));
  other.setInputCloud(pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>());
  expectEmpty(other);
  auto crooked = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud);
  crooked->height = 1000;
  other.setInputCloud(crooked);
  expectEmpty(other);
}

}} // namespace holdfast
