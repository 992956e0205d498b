#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/patch_estimation.h>
#include <holdfast/pcl/range_covariance_estimation.h>
#include <holdfast/sensor/constant_noise_model.h>

#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/filters/passthrough.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/search/kdtree.h>
#include <pcl/search/organized.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace holdfast { namespace {

using test::kNaN;
using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;
using Points = pcl::PointCloud<pcl::PointXYZ>;
using Patches = pcl::PointCloud<PatchPoint>;

const Camera kCamera = makeCamera(160, 120, 150.0);

/// Rolling ground with the depth noise of the sensor and some holes, which knows where
/// it was taken from.
Points::Ptr
makeGround(Random& random, const Pose& pose = {})
{
  const RangeCloud range = makeOrganizedCloud(
      kCamera,
      [&random](int u, int v) {
        const double depth = 1.0 + 0.1 * std::sin(0.06 * u) * std::cos(0.05 * v);
        return random.uniform(0.0, 1.0) < 0.02 ? std::nan("") :
                                                 depth + 0.003 * random.normal();
      },
      pose);
  auto cloud = pcl::make_shared<Points>(*range.points);
  writeSensorPose(pose, *cloud);
  return cloud;
}

Pose
randomPose(Random& random)
{
  return {random.rotation(), random.uniformVector(-1.0, 1.0)};
}

/// Finite points all over the cloud.
pcl::IndicesPtr
someSeeds(const Points& cloud)
{
  auto seeds = pcl::make_shared<pcl::Indices>();
  for (int i = 10 * 160 + 10; i < static_cast<int>(cloud.size()); i += 997)
    if (pcl::isFinite(cloud[i]))
      seeds->push_back(i);
  return seeds;
}

PatchEstimation<pcl::PointXYZ>
makeEstimation(const Points::ConstPtr& cloud)
{
  PatchEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(makeSensor(kCamera));
  estimation.setNumberOfThreads(1);
  return estimation;
}

bool
sameBytes(const PatchPoint& a, const PatchPoint& b)
{
  return std::memcmp(&a, &b, offsetof(PatchPoint, verdict) + 1) == 0;
}

void
expectSamePoints(const Patches& a, const Patches& b)
{
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE(sameBytes(a[i], b[i])) << "point " << i;
}

TEST(Seeds, FromTheSamplerGiveWhatTheEngineGives)
{
  Random random;
  const auto cloud = makeGround(random, randomPose(random));
  ExtractionOptions options;
  options.sampler.radius_m = 0.08;
  options.sampler.spacing_m = 0.1;
  options.validation.emplace();
  auto estimation = makeEstimation(cloud);
  estimation.setOptions(options);
  estimation.setSeedsFromSampler(true);
  Patches patches;
  estimation.compute(patches);

  const ExtractionResult expected =
      extractPatches(toRangeCloud<pcl::PointXYZ>(cloud), makeSensor(kCamera), options);
  const std::vector<ExtractedPatch> found = acceptedAmong(estimation.getResults());
  EXPECT_EQ(estimation.getExtraction().rejected, expected.rejected);
  ASSERT_EQ(found.size(), expected.patches.size());
  ASSERT_GT(found.size(), 50U);
  EXPECT_EQ(patches.size(), estimation.getResults().size());
  EXPECT_EQ(patches.height, 1U);
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_TRUE(sameBytes(toPatchPoint(found[i]), toPatchPoint(expected.patches[i])));
}

TEST(Seeds, FromTheSamplerStopAtItsLimits)
{
  Random random;
  const auto cloud = makeGround(random);
  auto estimation = makeEstimation(cloud);
  ExtractionOptions options;
  options.sampler.radius_m = 0.08;
  options.sampler.max_area_m2 = 0.1;
  estimation.setOptions(options);
  estimation.setSeedsFromSampler(true);
  Patches patches;
  estimation.compute(patches);
  const std::size_t few = patches.size();
  EXPECT_GT(few, 2U);
  EXPECT_EQ(patches.width, few);
  EXPECT_EQ(estimation.getResults().size(), few);
  EXPECT_EQ(estimation.getNotices().size(), 1U);
  options.sampler.max_area_m2 = 0.0;
  estimation.setOptions(options);
  estimation.compute(patches);
  EXPECT_GT(patches.size(), 2 * few);
  EXPECT_TRUE(estimation.getNotices().empty());
}

TEST(Seeds, AreTheIndicesInTheirOrder)
{
  Random random;
  const auto cloud = makeGround(random);
  const auto seeds = someSeeds(*cloud);
  std::reverse(seeds->begin(), seeds->end());
  auto estimation = makeEstimation(cloud);
  estimation.setIndices(seeds);
  estimation.setSeedsFromSampler(true); // indices go first
  estimation.setRadiusSearch(0.08);
  Patches patches;
  estimation.compute(patches);
  ASSERT_EQ(patches.size(), seeds->size());
  ASSERT_EQ(estimation.getResults().size(), seeds->size());
  EXPECT_TRUE(patches.is_dense);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    EXPECT_EQ(patches[i].seed, (*seeds)[i]);
    EXPECT_LT(
        (patches[i].getVector3fMap() - (*cloud)[(*seeds)[i]].getVector3fMap()).norm(),
        0.08F);
    EXPECT_TRUE(sameBytes(patches[i], toPatchPoint(estimation.getResults()[i])));
  }
}

TEST(Seeds, AreAllPointsWithoutIndicesAndKeepTheGrid)
{
  Random random;
  auto cloud = makeGround(random);
  auto corner = pcl::make_shared<Points>();
  for (int v = 0; v < 20; ++v)
    for (int u = 0; u < 30; ++u)
      corner->push_back((*cloud)(u, v));
  corner->width = 30;
  corner->height = 20;
  corner->is_dense = false;
  auto estimation = makeEstimation(corner);
  estimation.setRadiusSearch(0.05);
  Patches patches;
  estimation.compute(patches);
  EXPECT_EQ(patches.width, 30U);
  EXPECT_EQ(patches.height, 20U);
  EXPECT_FALSE(patches.is_dense); // the holes
  std::size_t found = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    found += pcl::isFinite(patches[i]);
    if (!pcl::isFinite((*corner)[i])) {
      EXPECT_TRUE(std::isnan(patches[i].x));
      EXPECT_EQ(patches[i].status, static_cast<int>(FitStatus::TooFewPoints));
    }
  }
  EXPECT_GT(found, 500U);
}

TEST(Threads, DoNotMatter)
{
  Random random;
  const auto cloud = makeGround(random);
  auto estimation = makeEstimation(cloud);
  estimation.setIndices(someSeeds(*cloud));
  for (const bool by_search : {false, true}) {
    if (by_search)
      estimation.setSearchMethod(
          pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimation.setRadiusSearch(0.06);
    estimation.setNumberOfThreads(1);
    Patches serial, parallel;
    estimation.compute(serial);
    estimation.setNumberOfThreads(3);
    estimation.compute(parallel);
    expectSamePoints(serial, parallel);
  }
}

/// An unorganized copy, for which the sampler searches balls.
Points::Ptr
unorganized(const Points& cloud)
{
  auto row = pcl::make_shared<Points>(cloud);
  row->width = static_cast<std::uint32_t>(row->size());
  row->height = 1;
  return row;
}

TEST(Neighborhoods, OfPclSearchesAreThoseOfTheSampler)
{
  Random random;
  const auto organized = makeGround(random, randomPose(random));
  const auto cloud = unorganized(*organized);
  const auto seeds = someSeeds(*cloud);
  for (const bool by_radius : {true, false}) {
    auto ours = makeEstimation(cloud);
    SamplerOptions balls;
    balls.neighborhood = Neighborhood::Ball;
    ours.setSamplerOptions(balls);
    ours.setIndices(seeds);
    ours.setRadiusSearch(by_radius ? 0.06 : 0.0);
    ours.setKSearch(by_radius ? 0 : 150);
    Patches expected;
    ours.compute(expected);
    ASSERT_TRUE(expected.is_dense);

    auto tree = makeEstimation(cloud);
    tree.setIndices(seeds);
    tree.setRadiusSearch(by_radius ? 0.06 : 0.0);
    tree.setKSearch(by_radius ? 0 : 150);
    tree.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    Patches patches;
    tree.compute(patches);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      EXPECT_EQ(patches[i].points, expected[i].points);
      EXPECT_EQ(patches[i].getVector3fMap(), expected[i].getVector3fMap());
    }
  }
}

TEST(Neighborhoods, OfAnOrganizedSearchAreBalls)
{
  Random random;
  const auto cloud = makeGround(random);
  SamplerOptions ball;
  ball.neighborhood = Neighborhood::Ball;
  auto estimation = makeEstimation(cloud);
  estimation.setIndices(someSeeds(*cloud));
  estimation.setSamplerOptions(ball);
  estimation.setRadiusSearch(0.06);
  Patches expected, patches;
  estimation.compute(expected);
  estimation.setSearchMethod(
      pcl::make_shared<pcl::search::OrganizedNeighbor<pcl::PointXYZ>>());
  estimation.compute(patches);
  ASSERT_EQ(patches.size(), expected.size());
  for (std::size_t i = 0; i < patches.size(); ++i)
    EXPECT_EQ(patches[i].points, expected[i].points);
}

TEST(Neighborhoods, ComeFromTheSearchSurface)
{
  Random random;
  const auto surface = makeGround(random);
  auto seeds = pcl::make_shared<Points>();
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(surface);
  grid.setLeafSize(0.1F, 0.1F, 0.1F);
  grid.filter(*seeds);
  auto estimation = makeEstimation(seeds);
  estimation.setSearchSurface(surface);
  estimation.setRadiusSearch(0.06);
  Patches patches;
  estimation.compute(patches);
  ASSERT_EQ(patches.size(), seeds->size());
  std::size_t found = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!pcl::isFinite(patches[i]))
      continue;
    ++found;
    EXPECT_GT(patches[i].points, 30); // one or two, if the seeds were the surface
    EXPECT_LT((patches[i].getVector3fMap() - (*seeds)[i].getVector3fMap()).norm(),
              0.08F);
  }
  EXPECT_GT(found, patches.size() / 2);
  // The search that PCL made for the surface does not outlive it.
  EXPECT_EQ(estimation.getSearchMethod(), nullptr);
}

TEST(Pipelines, FilterAndEstimate)
{
  Random random;
  const auto cloud = makeGround(random);
  auto near = pcl::make_shared<Points>();
  pcl::PassThrough<pcl::PointXYZ> pass;
  pass.setInputCloud(cloud);
  pass.setFilterFieldName("z");
  pass.setFilterLimits(0.0F, 1.05F);
  pass.setKeepOrganized(true);
  pass.filter(*near);
  auto estimation = makeEstimation(near);
  estimation.setSeedsFromSampler(true);
  estimation.setRadiusSearch(0.06);
  Patches patches;
  estimation.compute(patches);
  const std::vector<ExtractedPatch> found = acceptedAmong(estimation.getResults());
  ASSERT_GT(found.size(), 30U);
  for (const ExtractedPatch& patch : found)
    EXPECT_LT(patch.fit.patch.c.z(), 1.06);
}

TEST(Noise, BesideTheCloudOrInItsPointsIsTheSame)
{
  Random random;
  const auto cloud = makeGround(random, randomPose(random));
  RangeCovarianceEstimation<pcl::PointXYZ> noise;
  noise.setInputCloud(cloud);
  noise.setSensor(makeSensor(kCamera));
  auto covariances = std::make_shared<Covariances>();
  noise.computeCovariances(*covariances);
  auto points = pcl::make_shared<pcl::PointCloud<PointXYZCovariance>>();
  noise.compute(*points);

  PatchEstimation<pcl::PointXYZ> beside;
  beside.setInputCloud(cloud);
  beside.setInputCovariances(covariances);
  beside.setIndices(someSeeds(*cloud));
  beside.setRadiusSearch(0.08);
  PatchEstimation<PointXYZCovariance> inside;
  inside.setInputCloud(points);
  inside.setIndices(someSeeds(*cloud));
  inside.setRadiusSearch(0.08);
  Patches a, b;
  beside.compute(a);
  inside.compute(b);
  ASSERT_TRUE(a.is_dense);
  expectSamePoints(a, b);

  // And, evaluated at the points, as from the model: covariances in single precision.
  auto estimation = makeEstimation(cloud);
  FitOptions at_points;
  at_points.noise_at_surface = false;
  estimation.setFitOptions(at_points);
  estimation.setIndices(someSeeds(*cloud));
  estimation.setRadiusSearch(0.08);
  Patches c;
  estimation.compute(c);
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_LT((a[i].getVector3fMap() - c[i].getVector3fMap()).norm(), 1e-5F);
}

TEST(SensorPose, TurnsNormalsAndNoise)
{
  Random random;
  const Pose pose = randomPose(random);
  const auto cloud = makeGround(random, pose);
  auto estimation = makeEstimation(cloud);
  estimation.setIndices(someSeeds(*cloud));
  estimation.setRadiusSearch(0.08);
  Patches patches;
  estimation.compute(patches);
  EXPECT_EQ(patches.sensor_origin_, cloud->sensor_origin_);
  const Eigen::Vector3f eye = pose.c.cast<float>();
  for (const PatchPoint& point : patches)
    EXPECT_GT(point.getNormalVector3fMap().dot(eye - point.getVector3fMap()), 0.0F);

  // A cloud that has lost its pose gets it back.
  auto moved = pcl::make_shared<Points>(*cloud);
  moved->sensor_origin_.setZero();
  moved->sensor_orientation_.setIdentity();
  auto told = makeEstimation(moved);
  told.setSensorPose(sensorPose(cloud->sensor_origin_, cloud->sensor_orientation_));
  told.setIndices(someSeeds(*cloud));
  told.setRadiusSearch(0.08);
  Patches same;
  told.compute(same);
  expectSamePoints(patches, same);
}

TEST(Outputs, MayBeOtherPointTypes)
{
  Random random;
  const auto cloud = makeGround(random);
  auto estimation = makeEstimation(cloud);
  estimation.setIndices(someSeeds(*cloud));
  estimation.setRadiusSearch(0.06);
  Patches patches;
  estimation.compute(patches);
  pcl::PointCloud<pcl::PointNormal> normals;
  pcl::copyPointCloud(patches, normals);
  for (std::size_t i = 0; i < patches.size(); ++i)
    EXPECT_EQ(normals[i].getNormalVector3fMap(), patches[i].getNormalVector3fMap());
}

TEST(Validation, TurnsPatchesDownWithTheReason)
{
  Random random;
  const auto cloud = makeGround(random);
  auto estimation = makeEstimation(cloud);
  estimation.setIndices(someSeeds(*cloud));
  SamplerOptions discs;
  discs.neighborhood = Neighborhood::Disc; // which have no second attempt
  estimation.setSamplerOptions(discs);
  estimation.setRadiusSearch(0.06);
  estimation.setValidationOptions(std::nullopt);
  Patches patches;
  estimation.compute(patches);
  ASSERT_TRUE(patches.is_dense);
  EXPECT_TRUE(std::isnan(patches[0].coverage)); // not even measured
  ValidationOptions limits = ValidationOptions::withoutLimits();
  estimation.setValidationOptions(limits);
  estimation.compute(patches);
  ASSERT_TRUE(patches.is_dense);
  std::vector<float> residuals;
  for (const PatchPoint& point : patches)
    residuals.push_back(point.residual);
  std::sort(residuals.begin(), residuals.end());
  const float limit = residuals[residuals.size() / 2];
  limits.max_residual_m = limit;
  estimation.setValidationOptions(limits);
  Patches judged;
  estimation.compute(judged);
  EXPECT_FALSE(judged.is_dense);
  for (std::size_t i = 0; i < judged.size(); ++i) {
    const bool good = judged[i].verdict == static_cast<int>(PatchVerdict::Accepted);
    EXPECT_EQ(pcl::isFinite(judged[i]), good);
    EXPECT_EQ(judged[i].residual, patches[i].residual);
    EXPECT_TRUE(good ||
                judged[i].verdict == static_cast<int>(PatchVerdict::ResidualTooLarge));
    EXPECT_TRUE(good ? judged[i].residual <= limit : judged[i].residual >= limit);
  }
}

class Misuse : public testing::Test {
protected:
  Misuse()
  {
    cloud_ = makeGround(random_);
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  }
  ~Misuse() override
  {
    pcl::console::setVerbosityLevel(pcl::console::L_INFO);
  }

  PatchEstimation<pcl::PointXYZ> good() const
  {
    auto estimation = makeEstimation(cloud_);
    estimation.setIndices(someSeeds(*cloud_));
    estimation.setRadiusSearch(0.05);
    return estimation;
  }

  template <typename PointT>
  static void expectEmpty(PatchEstimation<PointT>& estimation)
  {
    Patches output(4, 3);
    estimation.compute(output);
    EXPECT_TRUE(output.empty());
    EXPECT_EQ(output.width, 0U);
    EXPECT_EQ(output.height, 0U);
    EXPECT_TRUE(estimation.getResults().empty());
  }

  template <typename PointT>
  static void expectNaN(PatchEstimation<PointT>& estimation, std::size_t count)
  {
    Patches output;
    estimation.compute(output);
    ASSERT_EQ(output.size(), count);
    EXPECT_FALSE(output.is_dense);
    for (const PatchPoint& point : output) {
      EXPECT_TRUE(std::isnan(point.x) && std::isnan(point.parameters[0]));
      EXPECT_EQ(point.status, static_cast<int>(FitStatus::TooFewPoints));
      EXPECT_EQ(point.verdict, static_cast<int>(PatchVerdict::NotUsable));
    }
  }

  Random random_;
  Points::Ptr cloud_;
};

TEST_F(Misuse, NoInputOrAnEmptyOne)
{
  PatchEstimation<pcl::PointXYZ> estimation;
  expectEmpty(estimation);
  estimation.setInputCloud(pcl::make_shared<Points>());
  estimation.setSensor(makeSensor(kCamera));
  expectEmpty(estimation);
  estimation.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setRadiusSearch(0.05);
  expectEmpty(estimation);
  auto crooked = pcl::make_shared<Points>(*cloud_);
  crooked->width = 7;
  estimation.setInputCloud(crooked);
  expectEmpty(estimation);
  auto on_surface = good();
  on_surface.setSearchSurface(crooked);
  expectEmpty(on_surface);
}

TEST_F(Misuse, IndicesOutOfRange)
{
  for (const int outside : {-1, 160 * 120, 1 << 30}) {
    auto estimation = good();
    estimation.setIndices(pcl::make_shared<pcl::Indices>(2, outside));
    expectEmpty(estimation);
  }
  auto none = good();
  none.setIndices(pcl::make_shared<pcl::Indices>());
  Patches output(4, 3);
  none.compute(output);
  EXPECT_TRUE(output.empty());
}

TEST_F(Misuse, BothRadiusAndKOrNeitherOrNegative)
{
  for (const bool by_search : {false, true}) {
    auto estimation = good();
    if (by_search)
      estimation.setSearchMethod(
          pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimation.setKSearch(50);
    expectEmpty(estimation);
    estimation.setRadiusSearch(0.0);
    estimation.setKSearch(-1);
    expectEmpty(estimation);
    estimation.setKSearch(0);
    estimation.setRadiusSearch(-0.05);
    expectEmpty(estimation);
    estimation.setRadiusSearch(std::nan(""));
    expectEmpty(estimation);
  }
  auto neither = good();
  neither.setRadiusSearch(0.0);
  neither.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  expectEmpty(neither);
}

TEST_F(Misuse, CovariancesOfTheWrongSizeOrNone)
{
  auto estimation = good();
  estimation.setInputCovariances(std::make_shared<const Covariances>(17));
  expectEmpty(estimation);
  PatchEstimation<pcl::PointXYZ> silent;
  silent.setInputCloud(cloud_);
  silent.setRadiusSearch(0.05);
  expectEmpty(silent);
}

TEST_F(Misuse, OptionsThatMakeNoSense)
{
  auto estimation = good();
  FitOptions fit;
  fit.containment = 2.0;
  estimation.setFitOptions(fit);
  expectEmpty(estimation);
  estimation = good();
  ValidationOptions limits;
  limits.min_coverage = -1.0;
  estimation.setValidationOptions(limits);
  expectEmpty(estimation);
  estimation = good();
  estimation.setNumberOfThreads(4000000000U);
  expectEmpty(estimation);
}

TEST_F(Misuse, OrganizedSearchInAnUnorganizedCloud)
{
  auto estimation = good();
  estimation.setInputCloud(unorganized(*cloud_));
  estimation.setSearchMethod(
      pcl::make_shared<pcl::search::OrganizedNeighbor<pcl::PointXYZ>>());
  expectEmpty(estimation);
  // Organized, but not by a camera.
  auto shuffled = pcl::make_shared<Points>(*cloud_);
  std::shuffle(shuffled->begin(), shuffled->end(), random_.engine());
  estimation.setInputCloud(shuffled);
  expectEmpty(estimation);
}

TEST_F(Misuse, SamplerSeedsWithAPclSearch)
{
  auto estimation = makeEstimation(cloud_);
  estimation.setSeedsFromSampler(true);
  estimation.setRadiusSearch(0.05);
  estimation.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  expectEmpty(estimation);
}

TEST_F(Misuse, CloudsWithoutAFinitePoint)
{
  auto nan = pcl::make_shared<Points>(8, 6, pcl::PointXYZ(kNaN, kNaN, kNaN));
  nan->is_dense = false;
  for (const Points::Ptr& cloud : {nan, unorganized(*nan)}) {
    auto estimation = makeEstimation(cloud);
    estimation.setRadiusSearch(0.05);
    expectNaN(estimation, 48);
    estimation.setSeedsFromSampler(true);
    Patches output;
    estimation.compute(output);
    EXPECT_TRUE(output.empty());
  }
  auto by_search = makeEstimation(nan);
  by_search.setRadiusSearch(0.05);
  by_search.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  expectEmpty(by_search);
  auto on_surface = good();
  on_surface.setSearchSurface(nan);
  expectEmpty(on_surface);
}

TEST_F(Misuse, FewPointsAndHugeK)
{
  auto few = pcl::make_shared<Points>();
  few->push_back({0.0F, 0.0F, 1.0F});
  few->push_back({0.1F, 0.0F, 1.0F});
  for (const bool by_search : {false, true}) {
    auto estimation = makeEstimation(few);
    if (by_search)
      estimation.setSearchMethod(
          pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimation.setKSearch(1000000);
    expectNaN(estimation, 2);
  }
}

/// A noise model that fails in the middle of the work.
struct BrokenNoise : ConstantNoiseModel {
  BrokenNoise() : ConstantNoiseModel(Parameters{}) {}
  void covariances(int,
                   const double*,
                   const double*,
                   const double*,
                   const CovarianceChannels&) const override
  {
    throw std::runtime_error("broken");
  }
};

TEST_F(Misuse, ExceptionsOfOthersAreReportedNotThrown)
{
  auto estimation = good();
  estimation.setNoiseModel(std::make_shared<const BrokenNoise>());
  expectEmpty(estimation);
  estimation.setSensor(makeSensor(kCamera)); // and it can go on
  Patches output;
  estimation.compute(output);
  EXPECT_FALSE(output.empty());
}

}} // namespace holdfast
