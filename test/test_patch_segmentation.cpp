// PatchSegmentation, used as pcl::SACSegmentation is.
#include "support/consensus_scene.h"

#include <holdfast/pcl/impl/patch_segmentation.hpp>

#include <pcl/sample_consensus/method_types.h>
#include <pcl/segmentation/impl/sac_segmentation.hpp>

#include <limits>

namespace holdfast { namespace {

using pcl::PointXYZ;
using test::ConsensusCase;
using test::ConsensusScene;
using test::makeConsensusScene;
using test::Random;
using test::surfaceSigma;

using Segmentation = PatchSegmentation<PointXYZ>;

constexpr double kThreeSigmas = 3.0;

int
modelTypeOf(SurfaceRequest request)
{
  for (int type = 0; type < 32; ++type)
    if (surfaceOfModelType(type) == request)
      return type;
  return -1;
}

template <typename PointT>
void
prepare(PatchSegmentation<PointT>& segmentation, int model_type)
{
  segmentation.setModelType(model_type);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setSigmaThreshold(kThreeSigmas);
  segmentation.setProbability(0.9999);
  segmentation.setMaxIterations(10000);
}

struct Segment {
  pcl::PointIndices inliers;
  pcl::ModelCoefficients coefficients;
};

template <typename PointT>
Segment
segment(PatchSegmentation<PointT>& segmentation)
{
  Segment result;
  result.inliers.indices = {1, 2, 3}; // to be overwritten
  result.coefficients.values = {1.0F};
  segmentation.segment(result.inliers, result.coefficients);
  return result;
}

void
expectNothing(Segmentation& segmentation)
{
  const Segment result = segment(segmentation);
  EXPECT_TRUE(result.inliers.indices.empty());
  EXPECT_TRUE(result.coefficients.values.empty());
  EXPECT_FALSE(isUsable(segmentation.getPatch().status));
}

// The patch lies on the truth within five of its sigmas, sqrt(3) larger for the clutter
// among its inliers (see test_sac_models.cpp).
void
expectPatch(const ConsensusScene& scene, const FitResult& fit)
{
  ASSERT_TRUE(isUsable(fit.status)) << statusName(fit.status);
  for (const Eigen::Vector3d& point : scene.truth)
    EXPECT_LT(std::abs(distanceToSurface(fit.patch, point)),
              5.0 * std::sqrt(3.0) * surfaceSigma(fit, point));
}

class SegmentationOf : public testing::TestWithParam<ConsensusCase> {};

TEST_P(SegmentationOf, FindsThePatchWithItsCovariance)
{
  for (std::uint64_t i = 0; i < 5; ++i) {
    Random random(i);
    const ConsensusScene scene = makeConsensusScene(GetParam().type, 0.3, random, 0.5);
    Segmentation segmentation;
    prepare(segmentation, modelTypeOf(GetParam().request));
    segmentation.setInputCloud(scene.cloud);
    segmentation.setInputCovariances(scene.covariances);
    const Segment found = segment(segmentation);
    const FitResult& fit = segmentation.getPatch();
    expectPatch(scene, fit);
    EXPECT_EQ(fit.points, static_cast<int>(found.inliers.indices.size()));
    EXPECT_EQ(fit.patch.type.surface, scene.patch.type.surface);
    // Inliers, coefficients and patch belong together.
    const auto& values = found.coefficients.values;
    const Eigen::VectorXf coefficients =
        Eigen::VectorXf::Map(values.data(), static_cast<Eigen::Index>(values.size()));
    pcl::Indices inliers;
    segmentation.getModel()->selectWithinDistance(coefficients, kThreeSigmas, inliers);
    EXPECT_EQ(inliers, found.inliers.indices);
    const PatchConsensus engine(GetParam().request);
    const auto surface = engine.surfaceFrom(coefficients);
    ASSERT_TRUE(surface);
    for (const Eigen::Vector3d& point : scene.truth) // coefficients are rounded
      EXPECT_NEAR(std::abs(distanceToSurface(*surface, point)),
                  std::abs(distanceToSurface(fit.patch, point)),
                  1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(All,
                         SegmentationOf,
                         testing::ValuesIn(test::consensusCases()),
                         test::consensusCaseName);

ConsensusScene
planeScene(Random& random)
{
  return makeConsensusScene({SurfaceType::Plane, BoundaryType::Ellipse}, 0.3, random);
}

TEST(PatchSegmentation, WorksWithTheMethodsOfPcl)
{
  for (const int method :
       {pcl::SAC_RANSAC, pcl::SAC_MSAC, pcl::SAC_LMEDS, pcl::SAC_PROSAC}) {
    Random random(static_cast<std::uint64_t>(method));
    const ConsensusScene scene = planeScene(random);
    Segmentation segmentation;
    prepare(segmentation, pcl::SACMODEL_PLANE);
    segmentation.setMethodType(method);
    segmentation.setMaxIterations(500);
    segmentation.setInputCloud(scene.cloud);
    segmentation.setInputCovariances(scene.covariances);
    segment(segmentation);
    expectPatch(scene, segmentation.getPatch());
  }
}

TEST(PatchSegmentation, TakesItsNoiseFromASensorOrFromTheInliers)
{
  Random random;
  const ConsensusScene scene = planeScene(random);
  Segmentation segmentation;
  prepare(segmentation, pcl::SACMODEL_PLANE);
  segmentation.setInputCloud(scene.cloud);
  segmentation.setDistanceThreshold(0.01); // metres
  segment(segmentation);
  expectPatch(scene, segmentation.getPatch());
  Sensor sensor;
  sensor.noise = scene.noise;
  segmentation.setSensor(sensor);
  segmentation.setSigmaThreshold(kThreeSigmas);
  segment(segmentation);
  expectPatch(scene, segmentation.getPatch());
}

TEST(PatchSegmentation, SearchesTheIndicesOnly)
{
  Random random;
  const ConsensusScene scene = planeScene(random);
  auto half = pcl::make_shared<pcl::PointIndices>();
  for (int i = 0; i < static_cast<int>(scene.cloud->size()); i += 2)
    half->indices.push_back(i);
  Segmentation segmentation;
  prepare(segmentation, pcl::SACMODEL_PLANE);
  segmentation.setInputCloud(scene.cloud);
  segmentation.setInputCovariances(scene.covariances);
  segmentation.setIndices(half);
  const Segment found = segment(segmentation);
  EXPECT_GT(found.inliers.indices.size(), 50U);
  for (const int index : found.inliers.indices)
    EXPECT_EQ(index % 2, 0);
  expectPatch(scene, segmentation.getPatch());
}

TEST(PatchSegmentation, LeavesOtherModelsToPcl)
{
  Random random;
  const ConsensusScene scene = planeScene(random);
  Segmentation ours;
  pcl::SACSegmentation<PointXYZ> theirs;
  Segment expected;
  for (auto* segmentation : {&theirs, static_cast<decltype(&theirs)>(&ours)}) {
    segmentation->setModelType(pcl::SACMODEL_LINE);
    segmentation->setDistanceThreshold(0.01);
    segmentation->setInputCloud(scene.cloud);
  }
  theirs.segment(expected.inliers, expected.coefficients);
  const Segment found = segment(ours);
  EXPECT_FALSE(found.inliers.indices.empty());
  EXPECT_EQ(found.inliers.indices, expected.inliers.indices);
  EXPECT_EQ(found.coefficients.values, expected.coefficients.values);
  EXPECT_FALSE(isUsable(ours.getPatch().status));
}

TEST(PatchSegmentation, HonoursRadiusLimits)
{
  Random random;
  const ConsensusScene scene =
      makeConsensusScene({SurfaceType::Sphere, BoundaryType::Circle}, 0.3, random, 0.5);
  const double radius = 1.0 / std::abs(scene.patch.kappa[0]);
  Segmentation segmentation;
  prepare(segmentation, pcl::SACMODEL_SPHERE);
  segmentation.setInputCloud(scene.cloud);
  segmentation.setInputCovariances(scene.covariances);
  segmentation.setRadiusLimits(0.8 * radius, 1.25 * radius);
  segment(segmentation);
  expectPatch(scene, segmentation.getPatch());
  segmentation.setRadiusLimits(1e-9, 2e-9);
  expectNothing(segmentation);
}

TEST(PatchSegmentation, FailsOnMisuse)
{
  Random random;
  const ConsensusScene scene = planeScene(random);
  Segmentation segmentation;
  prepare(segmentation, pcl::SACMODEL_PLANE);
  expectNothing(segmentation); // no input
  segmentation.setInputCloud(pcl::make_shared<pcl::PointCloud<PointXYZ>>());
  expectNothing(segmentation);

  segmentation.setInputCloud(scene.cloud);
  auto covariances = std::make_shared<Covariances>(*scene.covariances);
  covariances->pop_back();
  segmentation.setInputCovariances(covariances);
  expectNothing(segmentation);
  segmentation.setInputCovariances(scene.covariances);
  EXPECT_FALSE(segment(segmentation).inliers.indices.empty());

  segmentation.setModelType(-1);
  expectNothing(segmentation);
  segmentation.setModelType(pcl::SACMODEL_TORUS);
  expectNothing(segmentation);
  segmentation.setModelType(pcl::SACMODEL_PLANE);

  for (const int method : {pcl::SAC_RANSAC, pcl::SAC_PROSAC}) {
    segmentation.setMethodType(method);
    for (const auto& indices :
         {pcl::Indices{0, 1}, pcl::Indices{0, 1, -5}, pcl::Indices{0, 1, 1 << 30}}) {
      segmentation.setIndices(pcl::make_shared<pcl::Indices>(indices));
      expectNothing(segmentation);
    }
  }
}

TEST(PatchSegmentation, FailsOnCloudsOfNaN)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const int method :
       {pcl::SAC_RANSAC, pcl::SAC_MSAC, pcl::SAC_LMEDS, pcl::SAC_PROSAC}) {
    Segmentation segmentation;
    prepare(segmentation, pcl::SACMODEL_SPHERE);
    segmentation.setMethodType(method);
    auto cloud = pcl::make_shared<pcl::PointCloud<PointXYZ>>();
    cloud->resize(50, PointXYZ(nan, nan, nan));
    cloud->is_dense = false;
    segmentation.setInputCloud(cloud);
    expectNothing(segmentation);
  }
}

TEST(PatchSegmentation, RefusesOptionsThatMakeNoSense)
{
  Segmentation segmentation;
  ConsensusOptions options;
  options.covariance = CovarianceMode::GaussNewton;
  segmentation.setOptions(options);
  EXPECT_EQ(segmentation.getOptions().covariance, CovarianceMode::GaussNewton);
  options.covariance = CovarianceMode::Exact;
  options.fit.max_iterations = -1;
  segmentation.setOptions(options);
  EXPECT_EQ(segmentation.getOptions().covariance, CovarianceMode::GaussNewton);
}

// Compiled here, from the impl headers.
TEST(PatchSegmentation, TakesPointTypesThatTheLibraryIsNotCompiledFor)
{
  Random random;
  const ConsensusScene scene = planeScene(random);
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZRGBNormal>>();
  pcl::copyPointCloud(*scene.cloud, *cloud);
  PatchSegmentation<pcl::PointXYZRGBNormal> segmentation;
  prepare(segmentation, pcl::SACMODEL_PLANE);
  segmentation.setInputCloud(cloud);
  segmentation.setInputCovariances(scene.covariances);
  segment(segmentation);
  expectPatch(scene, segmentation.getPatch());
}

}} // namespace holdfast
