/// \file What an engineer with a pipeline of PCL expects to find here as well.
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/patch_estimation.h>
#include <holdfast/pcl/patch_segmentation.h>
#include <holdfast/pcl/print.h>
#include <holdfast/pcl/range_covariance_estimation.h>

#include <pcl/common/io.h>
#include <pcl/common/point_tests.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/extract_indices.h>
#include <pcl/filters/passthrough.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <sstream>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;
using Points = pcl::PointCloud<pcl::PointXYZ>;
using Patches = pcl::PointCloud<PatchPoint>;

const Camera kCamera = makeCamera(160, 120, 150.0);
constexpr double kBall = 0.4; // m, radius
/// Variance of the depth at 1.5 m, (0.17 z^2 / (580 0.075))^2 in m^2.
constexpr float kNoiseAtWall = 7.7e-5F;

/// A wall at 1.5 m and, in its left half, a ball in front of it, with noise.
Points::Ptr
makeBallOnWall(Random& random)
{
  const Sensor sensor = makeSensor(kCamera);
  const Eigen::Vector3d centre(-0.3, 0.0, 1.4);
  const RangeCloud range = makeOrganizedCloud(kCamera, [&](int u, int v) {
    const Eigen::Vector3d ray = kCamera.backProject(u, v, 1.0);
    const double b = ray.dot(centre), a = ray.squaredNorm();
    const double root = b * b - a * (centre.squaredNorm() - kBall * kBall);
    const double depth = root > 0.0 ? (b - std::sqrt(root)) / a : 1.5;
    return depth +
           random.normal() * std::sqrt(sensor.noise->covariance(depth * ray)(2, 2));
  });
  return pcl::make_shared<Points>(*range.points);
}

template <typename PointInT, typename PointOutT = PatchPoint>
PatchEstimation<PointInT, PointOutT>
makeEstimation(const typename pcl::PointCloud<PointInT>::ConstPtr& cloud)
{
  PatchEstimation<PointInT, PointOutT> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(makeSensor(kCamera));
  estimation.setRadiusSearch(0.1);
  auto seeds = pcl::make_shared<pcl::Indices>();
  for (int i = 15 * 160 + 15; i < static_cast<int>(cloud->size()); i += 1009)
    seeds->push_back(i);
  estimation.setIndices(seeds);
  return estimation;
}

template <typename PointT>
class FurtherPointTypes : public testing::Test {};

using FurtherTypes = testing::Types<pcl::PointXYZL,
                                    pcl::PointXYZRGBL,
                                    pcl::PointXYZINormal,
                                    pcl::PointXYZRGBNormal>;
TYPED_TEST_SUITE(FurtherPointTypes, FurtherTypes);

TYPED_TEST(FurtherPointTypes, AreCompiledAndGiveWhatPlainPointsGive)
{
  Random random;
  const auto plain = makeBallOnWall(random);
  auto cloud = pcl::make_shared<pcl::PointCloud<TypeParam>>();
  pcl::copyPointCloud(*plain, *cloud);
  Patches expected, patches;
  makeEstimation<pcl::PointXYZ>(plain).compute(expected);
  makeEstimation<TypeParam>(cloud).compute(patches);
  ASSERT_EQ(patches.size(), expected.size());
  for (std::size_t i = 0; i < patches.size(); ++i)
    EXPECT_EQ(std::memcmp(&patches[i], &expected[i], offsetof(PatchPoint, verdict) + 1),
              0);

  RangeCovarianceEstimation<TypeParam> noise;
  noise.setInputCloud(cloud);
  noise.setNoiseModel(makeSensor(kCamera).noise);
  pcl::PointCloud<PointXYZCovariance> covariances;
  noise.compute(covariances);
  EXPECT_EQ(covariances.size(), cloud->size());

  PatchSegmentation<TypeParam> segmentation;
  segmentation.setInputCloud(cloud);
  segmentation.setSensor(makeSensor(kCamera));
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  pcl::PointIndices inliers;
  pcl::ModelCoefficients coefficients;
  segmentation.segment(inliers, coefficients);
  EXPECT_GT(inliers.indices.size(), cloud->size() / 3) << "the wall";
}

TEST(Curvature, OfPointNormalIsTheMeanAbsoluteOne)
{
  Random random;
  const auto cloud = makeBallOnWall(random);
  auto estimation = makeEstimation<pcl::PointXYZ, pcl::PointNormal>(cloud);
  pcl::PointCloud<pcl::PointNormal>::Ptr normals(new pcl::PointCloud<pcl::PointNormal>);
  estimation.compute(*normals);
  ASSERT_EQ(normals->size(), estimation.getResults().size());
  for (std::size_t i = 0; i < normals->size(); ++i) {
    const ExtractedPatch& patch = estimation.getResults()[i];
    if (!isAccepted(patch)) {
      EXPECT_TRUE(std::isnan((*normals)[i].curvature));
      continue;
    }
    const Eigen::Vector2d k = patch.fit.patch.principalCurvatures();
    EXPECT_FLOAT_EQ((*normals)[i].curvature, 0.5 * (std::abs(k.x()) + std::abs(k.y())));
  }
  // PCL's filter tells the ball, of curvature 1/R, from the wall.
  pcl::PassThrough<pcl::PointNormal> curved;
  curved.setInputCloud(normals);
  curved.setFilterFieldName("curvature");
  curved.setFilterLimits(0.5F / kBall, 2.0F / kBall);
  pcl::PointCloud<pcl::PointNormal> ball;
  curved.filter(ball);
  ASSERT_GT(ball.size(), 5U);
  float mean = 0.0F;
  for (const pcl::PointNormal& point : ball) {
    EXPECT_LT(point.z, 1.45F) << "in front of the wall";
    mean += point.curvature / static_cast<float>(ball.size());
  }
  EXPECT_NEAR(mean * kBall, 1.0, 0.2) << "each alone has a sigma of about a third";
}

TEST(KeptIndices, AreThePointsOfThePatch)
{
  Random random;
  const auto cloud = makeBallOnWall(random);
  cloud->header.frame_id = "camera";
  for (const bool with_search : {false, true}) {
    auto estimation = makeEstimation<pcl::PointXYZ>(cloud);
    if (with_search)
      estimation.setSearchSurface(pcl::make_shared<Points>(*cloud));
    Patches patches;
    estimation.compute(patches);
    EXPECT_TRUE(estimation.getPatchIndices().empty()) << "nobody asked";
    estimation.setKeepIndices(true);
    estimation.compute(patches);
    ASSERT_EQ(estimation.getPatchIndices().size(), patches.size());
    int accepted = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const pcl::PointIndices& points = estimation.getPatchIndices()[i];
      const FitResult& fit = estimation.getResults()[i].fit;
      if (!isAccepted(estimation.getResults()[i])) {
        EXPECT_TRUE(points.indices.empty());
        continue;
      }
      ++accepted;
      EXPECT_EQ(points.header.frame_id, "camera");
      EXPECT_EQ(static_cast<int>(points.indices.size()),
                fit.points + fit.invalid_points + fit.uninformative_points);
      EXPECT_TRUE(std::is_sorted(points.indices.begin(), points.indices.end()));
      // The other side: PCL's plane through the same points.
      Eigen::Vector4f plane;
      float share = 0.0F;
      ASSERT_TRUE(pcl::computePointNormal(*cloud, points.indices, plane, share));
      EXPECT_GT(std::abs(plane.head<3>().dot(patches[i].getNormalVector3fMap())),
                0.98F);
    }
    EXPECT_GT(accepted, 8) << with_search;
  }
}

TEST(ViewPoint, TurnsNormalsAsPclDoes)
{
  Random random;
  const auto cloud = makeBallOnWall(random);
  // Behind the wall, and so far that every ray is as from the front.
  for (const float z : {0.0F, 40.0F}) {
    auto estimation = makeEstimation<pcl::PointXYZ>(cloud);
    estimation.setInputCovariances(
        std::make_shared<Covariances>(cloud->size(),
                                      kNoiseAtWall * Eigen::Matrix3f::Identity()));
    estimation.setSearchSurface(pcl::make_shared<Points>(*cloud));
    estimation.setViewPoint(0.0F, 0.0F, z);
    Patches patches;
    estimation.compute(patches);
    int accepted = 0;
    for (const PatchPoint& patch : patches) {
      if (!pcl::isFinite(patch))
        continue;
      ++accepted;
      float nx = patch.normal_x, ny = patch.normal_y, nz = patch.normal_z;
      pcl::flipNormalTowardsViewpoint(patch, 0.0F, 0.0F, z, nx, ny, nz);
      EXPECT_EQ(nz, patch.normal_z) << "PCL has nothing to flip";
    }
    EXPECT_GT(accepted, 8) << z;
    EXPECT_EQ(patches.sensor_origin_.z(), z);
  }
}

TEST(ViewPoint, TheLastOfItAndThePoseHolds)
{
  Random random;
  auto estimation = makeEstimation<pcl::PointXYZ>(makeBallOnWall(random));
  const auto originAfter = [&] {
    Patches patches;
    estimation.compute(patches);
    return patches.sensor_origin_.x();
  };
  Pose pose;
  pose.c.x() = 0.25;
  estimation.setViewPoint(0.5F, 0.0F, 0.0F);
  EXPECT_EQ(originAfter(), 0.5F);
  estimation.setSensorPose(pose);
  EXPECT_EQ(originAfter(), 0.25F);
  estimation.setViewPoint(0.5F, 0.0F, 0.0F);
  EXPECT_EQ(originAfter(), 0.5F);
  estimation.useSensorOriginAsViewPoint();
  EXPECT_EQ(originAfter(), 0.0F);
}

template <typename T>
std::string
printed(const T& thing)
{
  std::ostringstream text;
  text.precision(3);
  text << thing;
  return text.str();
}

TEST(Streams, SayWhatThingsAre)
{
  Random random;
  const auto cloud = makeBallOnWall(random);
  auto estimation = makeEstimation<pcl::PointXYZ>(cloud);
  Patches patches;
  estimation.compute(patches);
  const auto& results = estimation.getResults();
  const auto good = std::find_if(results.begin(), results.end(), isAccepted);
  ASSERT_NE(good, results.end());
  const std::string text = printed(*good);
  EXPECT_NE(text.find(printed(good->fit.patch)), std::string::npos) << text;
  EXPECT_NE(text.find(" m, normal ("), std::string::npos) << text;
  EXPECT_NE(text.find(std::to_string(good->fit.points) + " points"), std::string::npos);
  EXPECT_EQ(printed(patches[static_cast<std::size_t>(good - results.begin())]), text)
      << "as many digits are the same in single precision";
  ExtractedPatch none;
  none.fit.status = FitStatus::TooFewPoints;
  EXPECT_EQ(printed(none), "no patch: too_few_points");
  EXPECT_EQ(printed(toPatchPoint(none)), "no patch: too_few_points");
  PatchPoint unknown;
  unknown.surface = 77;
  EXPECT_EQ(printed(unknown), "no patch of a known type");
  const std::string summary = printed(estimation.getExtraction());
  EXPECT_NE(summary.find(" patches of 19200 points by test"), std::string::npos)
      << summary;
  EXPECT_EQ(printed(toRangeCloud<pcl::PointXYZ>(cloud)),
            "160 x 120 points, organized, 19200 valid, seen from (0, 0, 0)");
  EXPECT_EQ(printed(RangeCloud{}), "no points");
}

}} // namespace holdfast
