#include "support/extraction_seeds.h"
#include "support/organized_cloud.h"
#include "support/own_covariances.h"
#include "support/random.h"

#include "pcl/point_selection.h"
#include "pcl/sampling_budget.h"
#include <holdfast/fit/reference_points.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/constant_noise_model.h>
#include <holdfast/sensor/dryanovski_noise_model.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;
using test::seedsOf;

const Camera kCamera = makeCamera(160, 120, 150.0);

double
rollingDepth(double u, double v)
{
  return 1.0 + 0.1 * std::sin(0.06 * u) * std::cos(0.05 * v);
}

/// Rolling ground with the depth noise of the sensor and some holes.
RangeCloud
makeRollingCloud(Random& random, const Pose& pose = {})
{
  return makeOrganizedCloud(
      kCamera,
      [&random](int u, int v) {
        if (random.uniform(0.0, 1.0) < 0.02)
          return std::nan("");
        return rollingDepth(u, v) + 0.003 * random.normal();
      },
      pose);
}

Pose
randomPose(Random& random)
{
  return {random.rotation(), random.uniformVector(-1.0, 1.0)};
}

ExtractionOptions
makeOptions(double radius = 0.08, double spacing = 0.1)
{
  ExtractionOptions options;
  options.sampler.radius_m = radius;
  options.sampler.spacing_m = spacing;
  options.threads = 1;
  options.validation = ValidationOptions::withoutLimits(); // every seed has its patch
  return options;
}

template <typename Derived>
bool
sameBits(const Eigen::PlainObjectBase<Derived>& a,
         const Eigen::PlainObjectBase<Derived>& b)
{
  using Scalar = typename Derived::Scalar;
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(),
                     b.data(),
                     sizeof(Scalar) * static_cast<std::size_t>(a.size())) == 0;
}

void
expectSameBits(const ExtractionResult& a, const ExtractionResult& b)
{
  EXPECT_EQ(a.rejected, b.rejected);
  EXPECT_EQ(a.points.used, b.points.used);
  EXPECT_EQ(a.notices, b.notices);
  ASSERT_EQ(a.patches.size(), b.patches.size());
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    const ExtractedPatch& p = a.patches[i];
    const ExtractedPatch& q = b.patches[i];
    EXPECT_EQ(p.seed_index, q.seed_index);
    EXPECT_EQ(p.fit.status, q.fit.status);
    EXPECT_EQ(p.fit.iterations, q.fit.iterations);
    EXPECT_TRUE(p.fit.patch.type == q.fit.patch.type);
    EXPECT_TRUE(sameBits(pack(p.fit.patch), pack(q.fit.patch)));
    EXPECT_TRUE(sameBits(p.fit.covariance, q.fit.covariance));
    EXPECT_EQ(std::memcmp(&p.fit.chi2, &q.fit.chi2, sizeof(double)), 0);
  }
}

/// Largest difference of two covariances of the same parameters, each in units of its
/// sigmas.
double
normalizedDifference(const ParameterMatrix& a, const ParameterMatrix& b)
{
  double worst = 0.0;
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index j = 0; j < a.cols(); ++j)
      worst =
          std::max(worst, std::abs(a(i, j) - b(i, j)) / std::sqrt(a(i, i) * a(j, j)));
  return worst;
}

void
expectSimilar(const FitResult& a, const FitResult& b, double tolerance_sigma)
{
  ASSERT_EQ(a.status, b.status);
  ASSERT_TRUE(a.patch.type == b.patch.type);
  EXPECT_EQ(a.points, b.points);
  const ParameterVector difference = pack(a.patch) - pack(b.patch);
  for (Eigen::Index i = 0; i < difference.size(); ++i)
    EXPECT_LE(std::abs(difference[i]), tolerance_sigma * std::sqrt(a.covariance(i, i)));
  EXPECT_LE(normalizedDifference(a.covariance, b.covariance), tolerance_sigma);
}

TEST(ExtractPatches, DoesNotDependOnTheNumberOfThreads)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random, randomPose(random));
  ExtractionOptions options = makeOptions();
  options.sampler.strategy = SeedStrategy::Poisson;
  const ExtractionResult serial = extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_GT(serial.patches.size(), 50U);
  for (const int threads : {0, 2, 3, 7}) {
    options.threads = threads;
    expectSameBits(serial, extractPatches(cloud, makeSensor(kCamera), options));
  }
}

/// Where the noise model is asked: at the points, or where they belong on the surface.
std::vector<Eigen::Vector3d>
noisePoints(const std::vector<Eigen::Vector3d>& camera_points, bool at_surface)
{
  if (!at_surface)
    return camera_points;
  PointBatch batch;
  for (const Eigen::Vector3d& q : camera_points)
    batch.add(q, Eigen::Matrix3d::Zero());
  computeReferencePoints(batch, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> moved;
  for (int i = 0; i < batch.size(); ++i)
    moved.emplace_back(batch.channel(PointBatch::RX)[i],
                       batch.channel(PointBatch::RY)[i],
                       batch.channel(PointBatch::RZ)[i]);
  return moved;
}

TEST(ExtractPatches, IsNeighborhoodThenCovariancesThenFit)
{
  Random random;
  const Pose pose = randomPose(random);
  const RangeCloud cloud = makeRollingCloud(random, pose);
  const Sensor sensor = makeSensor(kCamera);
  for (const bool at_surface : {false, true}) {
    ExtractionOptions options = makeOptions(0.08, 0.25);
    options.fit.noise_at_surface = at_surface;
    const ExtractionResult result = extractPatches(cloud, sensor, options);
    ASSERT_GT(result.patches.size(), 5U);

    const NeighborhoodSampler sampler(cloud, sensor, options.sampler);
    const auto scratch = sampler.makeScratch();
    for (const ExtractedPatch& extracted : result.patches) {
      std::vector<int> indices;
      sampler.neighborhood(*extracted.seed_index, *scratch, indices);
      std::vector<Eigen::Vector3d> points, camera_points;
      for (const int i : indices) {
        points.push_back((*cloud.points)[i].getVector3fMap().cast<double>());
        camera_points.push_back(pose.toLocal(points.back()));
      }
      const std::vector<Eigen::Vector3d> at = noisePoints(camera_points, at_surface);
      PointBatch batch;
      batch.clear(extracted.seed, pose.c);
      for (std::size_t i = 0; i < points.size(); ++i)
        batch.add(points[i],
                  pose.R * sensor.noise->covariance(at[i]) * pose.R.transpose());
      // The sums of three products in another order, and an ill-conditioned fit.
      expectSimilar(estimatePatch(batch, options.fit, options.covariance),
                    extracted.fit,
                    1e-6);
      EXPECT_EQ(extracted.radius_m, options.sampler.radius_m);
    }
  }
}

TEST(ExtractPatches, NormalsPointToTheSensor)
{
  Random random;
  const Pose pose = randomPose(random);
  const ExtractionResult result = extractPatches(makeRollingCloud(random, pose),
                                                 makeSensor(kCamera),
                                                 makeOptions());
  ASSERT_FALSE(result.patches.empty());
  for (const ExtractedPatch& p : result.patches)
    EXPECT_GT(p.fit.patch.normal().dot(pose.c - p.fit.patch.c), 0.0);
}

TEST(ExtractPatches, KeepsTheOrderOfTheSeedsAndCountsTheRest)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  ExtractionOptions options = makeOptions();
  options.sampler.strategy = SeedStrategy::Random;
  options.sampler.max_seeds = 150;
  options.sampler.radius_m = 0.015; // few points: some fits fail
  const std::vector<int> seeds =
      NeighborhoodSampler(cloud, makeSensor(kCamera), options.sampler).seeds();
  const ExtractionResult result = extractPatches(cloud, makeSensor(kCamera), options);
  std::size_t rejected = 0;
  for (const auto& [status, count] : result.rejected) {
    EXPECT_FALSE(isUsable(status));
    rejected += static_cast<std::size_t>(count);
  }
  EXPECT_EQ(result.patches.size() + rejected, seeds.size());
  auto next = seeds.begin();
  for (const ExtractedPatch& p : result.patches) {
    next = std::find(next, seeds.end(), *p.seed_index);
    ASSERT_NE(next, seeds.end());
    EXPECT_EQ(p.seed, (*cloud.points)[*p.seed_index].getVector3fMap().cast<double>());
  }
}

TEST(ExtractPatches, StopsWhenTheAreaIsCovered)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  const Sensor sensor = makeSensor(kCamera);
  ExtractionOptions options = makeOptions();
  options.sampler.max_area_m2 = 1e3;
  const std::vector<int> all = seedsOf(extractPatches(cloud, sensor, options));

  options.sampler.max_area_m2 = 0.2;
  const ExtractionResult some = extractPatches(cloud, sensor, options);
  const std::vector<int> seeds = seedsOf(some);
  ASSERT_LT(seeds.size(), all.size());
  EXPECT_TRUE(std::equal(seeds.begin(), seeds.end(), all.begin()));
  ASSERT_EQ(some.notices.size(), 1U);
  EXPECT_NE(some.notices[0].find("stopped at the limit"), std::string::npos);

  const NeighborhoodSampler sampler(cloud, sensor, options.sampler);
  const auto scratch = sampler.makeScratch();
  SamplingBudget budget(options.sampler, cloud.points->size());
  std::vector<int> indices;
  for (const ExtractedPatch& patch : some.patches) {
    EXPECT_FALSE(budget.isSpent());
    sampler.neighborhood(*patch.seed_index, *scratch, indices);
    budget.cover(indices, projectedArea(patch.fit.patch));
  }
  EXPECT_TRUE(budget.isSpent());

  for (const int threads : {2, 3, 7}) {
    options.threads = threads;
    EXPECT_EQ(seedsOf(extractPatches(cloud, sensor, options)), seeds) << threads;
  }
}

TEST(ExtractPatches, StopsWhenTheTimeIsOver)
{
  Random random;
  ExtractionOptions options = makeOptions(0.08, 0.01);
  options.sampler.max_time_s = 1e-12; // over before the first fit
  const ExtractionResult result =
      extractPatches(makeRollingCloud(random), makeSensor(kCamera), options);
  EXPECT_TRUE(result.patches.empty());
  EXPECT_EQ(result.notices.size(), 1U);
}

/// The covariances that the sensor's model gives, attached to the cloud.
RangeCloud
withCovariances(RangeCloud cloud, const Sensor& sensor)
{
  const Pose& pose = cloud.sensor_pose;
  Covariances& covariances = test::ownCovariances(cloud);
  for (const pcl::PointXYZ& p : *cloud.points) {
    const Eigen::Vector3d q = pose.toLocal(p.getVector3fMap().cast<double>());
    covariances.emplace_back(
        (pose.R * sensor.noise->covariance(q) * pose.R.transpose()).cast<float>());
  }
  return cloud;
}

/// However slow the computer is: no thread begins more than one patch after the time is
/// over, which is that of the look at the clock before the patch.
TEST(ExtractPatches, BeginsAtMostOnePatchPerThreadWhenTheTimeIsOver)
{
  using Clock = SamplingBudget::Clock;
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  ExtractionOptions options = makeOptions();
  options.threads = 3;
  options.sampler.max_time_s = 0.03;
  PatchSites sites;
  sites.seeds = seedsAt(cloud, std::vector<int>(1000, 60 * kCamera.width + 80));
  std::array<std::vector<Clock::time_point>, 3> begun;
  sites.search = [&](const Seed&, int thread, std::vector<int>& indices) {
    begun[static_cast<std::size_t>(thread)].push_back(Clock::now());
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    indices.clear();
  };
  extractPatches(cloud, makeSensor(kCamera), options, sites);
  // The time began to run before the first patch.
  Clock::time_point first = Clock::time_point::max();
  std::size_t tried = 0;
  for (const auto& times : begun) {
    tried += times.size();
    for (const Clock::time_point time : times)
      first = std::min(first, time);
  }
  EXPECT_LT(tried, sites.seeds->size());
  const auto over = first + std::chrono::duration<double>(options.sampler.max_time_s);
  for (const auto& times : begun)
    EXPECT_LE(std::count_if(times.begin(),
                            times.end(),
                            [&](Clock::time_point time) { return time > over; }),
              1);
}

TEST(ExtractPatches, TakesTheCovariancesOfTheCloud)
{
  Random random;
  const Sensor sensor = makeSensor(kCamera);
  const RangeCloud cloud = makeRollingCloud(random, randomPose(random));
  const RangeCloud with = withCovariances(cloud, sensor);
  Sensor other = sensor;
  other.noise = std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{0.5, 0.5});
  // Larger than the pixel pitch: neither neighbourhood is cut, whichever the sensor.
  ExtractionOptions options = makeOptions(0.08, 0.25);
  options.fit.noise_at_surface = false; // the cloud's covariances are of its points
  const ExtractionResult a = extractPatches(cloud, sensor, options);
  const ExtractionResult b = extractPatches(with, other, options);
  ASSERT_EQ(a.patches.size(), b.patches.size());
  EXPECT_EQ(b.points.invalid_covariance, 0);
  // Covariances in single precision: 6e-8 each, and an ill-conditioned fit.
  for (std::size_t i = 0; i < a.patches.size(); ++i)
    expectSimilar(a.patches[i].fit, b.patches[i].fit, 1e-3);
}

TEST(ExtractPatches, LeavesOutPointsWithoutACovariance)
{
  Random random;
  const Sensor sensor = makeSensor(kCamera);
  const RangeCloud good =
      withCovariances(makeOrganizedCloud(kCamera, rollingDepth), sensor);
  RangeCloud bad = good;
  Covariances& covariances = test::ownCovariances(bad);
  covariances[100](1, 1) = -1e-4F;
  covariances[5000].setConstant(test::kNaN);
  covariances[9000](0, 1) = 10.0F; // not symmetric, not definite
  const ExtractionOptions options = makeOptions();
  EXPECT_EQ(extractPatches(good, sensor, options).points.invalid_covariance, 0);
  EXPECT_EQ(extractPatches(bad, sensor, options).points.invalid_covariance, 3);
  EXPECT_EQ(selectPoints(bad, sensor).cloud.covariances, bad.covariances); // no copy
  const ExtractionResult whole = extractWhole(bad, sensor, options);
  EXPECT_EQ(whole.points.invalid_covariance, 3);
  ASSERT_EQ(whole.patches.size(), 1U);
  EXPECT_EQ(whole.patches[0].fit.points, 160 * 120 - 3);
}

TEST(ExtractPatches, AsksModelsThatLookAtNeighborsForTheWholeImage)
{
  Random random;
  const Pose pose = randomPose(random);
  const RangeCloud cloud = makeRollingCloud(random, pose);
  Sensor sensor = makeSensor(kCamera);
  sensor.noise = std::make_shared<const DryanovskiNoiseModel>(sensor.noise);
  std::vector<Eigen::Vector3d> image;
  for (const pcl::PointXYZ& p : *cloud.points)
    image.push_back(pose.toLocal(p.getVector3fMap().cast<double>()));
  RangeCloud with = cloud;
  Covariances& covariances = test::ownCovariances(with);
  covariances = sensor.noise->imageCovariances(image, kCamera.width, kCamera.height);
  for (Eigen::Matrix3f& S : covariances)
    S = (pose.R.cast<float>() * S * pose.R.cast<float>().transpose()).eval();
  ExtractionOptions options = makeOptions(0.08, 0.25);
  // Discs, and cut by slope alone, since the depth noise of a single point is not that
  // of the image.
  options.sampler.neighborhood = Neighborhood::Disc;
  options.sampler.jump_sigmas = 0.0;
  options.sampler.max_slope = 10.0;
  expectSameBits(extractPatches(cloud, sensor, options),
                 extractPatches(with, sensor, options));
}

TEST(ExtractPatches, ReportsProgress)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  ExtractionOptions options = makeOptions(0.05, 0.05);
  options.threads = 3;
  int last = 0;
  int total = 0;
  options.progress = [&](int done, int of) {
    EXPECT_GT(done, last);
    last = done;
    total = of;
  };
  extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_GT(total, 100);
  EXPECT_EQ(last, total);
}

TEST(ExtractPatches, LetsExceptionsOfTheCallerThrough)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  ExtractionOptions options = makeOptions(0.05, 0.05);
  options.threads = 2;
  options.progress = [](int, int) { throw std::runtime_error("enough"); };
  EXPECT_THROW(extractPatches(cloud, makeSensor(kCamera), options), std::runtime_error);
}

/// Two walls that meet at a right angle along a vertical edge, as seen from inside.
RangeCloud
makeCorner(Random& random)
{
  return makeOrganizedCloud(kCamera, [&](int u, int) {
    const double s = (u - kCamera.cx) / kCamera.fx;
    return 1.5 / (1.0 + std::abs(s)) + 0.002 * random.normal();
  });
}

TEST(Acceptance, ByDefaultGivesPatchesOfTheirRadiusOnly)
{
  Random random;
  ExtractionOptions options = makeOptions();
  options.validation = ValidationOptions();
  for (const RangeCloud& cloud : {makeRollingCloud(random), makeCorner(random)}) {
    const ExtractionResult result = extractPatches(cloud, makeSensor(kCamera), options);
    EXPECT_GT(result.patches.size(), 50U);
    for (const ExtractedPatch& patch : result.patches) {
      const Validation& measured = *patch.validation;
      const double radius = options.sampler.radius_m;
      EXPECT_EQ(measured.verdict, PatchVerdict::Accepted);
      EXPECT_LE(measured.extent_m, 1.3 * radius);
      EXPECT_LE(measured.sagitta_m, 0.5 * radius);
      EXPECT_LE(measured.residual.unexplained_m, radius / 3.0);
      EXPECT_LE(measured.chi2_per_dof, 3.0);
      EXPECT_GE(measured.coverage.share, 0.5);
    }
  }
}

// A table before a wall: no patch given reaches over its edge, though bounds reach
// beyond the points they follow from.
TEST(Acceptance, NoPatchReachesOverAnEdge)
{
  Random random;
  const RangeCloud cloud = makeOrganizedCloud(kCamera, [&](int u, int) {
    return (u < 80 ? 1.0 : 1.3) + 0.002 * random.normal();
  });
  ExtractionOptions options = makeOptions(0.08, 0.04);
  options.validation = ValidationOptions();
  const ExtractionResult result = extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_GT(result.patches.size(), 100U);
  EXPECT_GT(result.turned_down.at(PatchVerdict::OverEdge), 5);
  const double edge = (79.5 - kCamera.cx) / kCamera.fx; // x of the table's, at 1 m
  for (const ExtractedPatch& patch : result.patches) {
    EXPECT_LE(patch.validation->stray_share.value(), 0.02);
    const Patch& fitted = patch.fit.patch;
    if (fitted.c.z() > 1.15)
      continue;
    int inside = 0, beyond = 0;
    for (int i = 0; i < 2000; ++i) {
      const double d = fitted.d.maxCoeff();
      const Eigen::Vector2d xy(random.uniform(-d, d), random.uniform(-d, d));
      if (!contains(fitted, xy))
        continue;
      ++inside;
      const auto z = height(fitted, xy.x(), xy.y());
      beyond += fitted.pose().toWorld({xy.x(), xy.y(), *z}).x() > edge ? 1 : 0;
    }
    // Of some 80 pixels one may stray: with a share of 9 % that is one case in 150.
    EXPECT_LT(beyond, 0.09 * inside);
  }
}

TEST(Acceptance, OnRequestKeepsWhatIsTurnedDownWithItsVerdict)
{
  Random random;
  const RangeCloud cloud = makeCorner(random);
  ExtractionOptions options = makeOptions();
  options.validation = ValidationOptions();
  options.validation->max_chi2_per_dof = 0.9;
  const ExtractionResult accepted = extractPatches(cloud, makeSensor(kCamera), options);
  options.keep_turned_down = true;
  const ExtractionResult all = extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_EQ(all.turned_down, accepted.turned_down);
  EXPECT_EQ(acceptedAmong(all.patches).size(), accepted.patches.size());
  std::size_t turned_down = 0;
  for (const auto& [verdict, count] : all.turned_down)
    turned_down += static_cast<std::size_t>(count);
  EXPECT_GT(turned_down, 0U);
  EXPECT_EQ(all.patches.size(), accepted.patches.size() + turned_down);
}

// Seeds near the corner, whose neighbourhoods hold both walls, get the part that is on
// theirs: nowhere does the wall leave a patch by more than the noise.
TEST(Acceptance, TriesTheSeedsOwnSurfaceWhereTwoMeet)
{
  Random random;
  const RangeCloud cloud = makeCorner(random);
  ExtractionOptions options = makeOptions(0.1, 0.05);
  options.validation = ValidationOptions();
  options.validation->max_chi2_per_dof = 1.5; // here the noise is known
  const ExtractionResult result = extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_GT(result.second_attempts, 5);
  int second = 0;
  for (const ExtractedPatch& patch : result.patches) {
    second += patch.is_second_attempt ? 1 : 0;
    if (!patch.is_second_attempt)
      continue;
    // Both walls are 45 degrees from the camera's axis, what holds both faces it: the
    // normal is nearer to that of the wall.
    const Eigen::Vector3d n = patch.fit.patch.normal();
    EXPECT_GT(std::asin(std::abs(n.x())), 0.5 * 0.785398) << n.transpose();
  }
  EXPECT_EQ(second, result.second_attempts);
}

TEST(Acceptance, ANumberOfPatchesIsTheBestOfAll)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  ExtractionOptions options = makeOptions();
  options.validation = ValidationOptions();
  const ExtractionResult all = extractPatches(cloud, makeSensor(kCamera), options);
  options.sampler.max_patches = 20;
  const ExtractionResult best = extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_EQ(best.patches.size(), 20U);
  EXPECT_EQ(best.turned_down, all.turned_down);
  ASSERT_FALSE(best.notices.empty());
  EXPECT_NE(best.notices.back().find("best 20 of"), std::string::npos);
  const auto meanCoverage = [](const ExtractionResult& result) {
    double sum = 0.0;
    for (const ExtractedPatch& patch : result.patches)
      sum += patch.validation->coverage.share;
    return sum / static_cast<double>(result.patches.size());
  };
  EXPECT_GT(meanCoverage(best), meanCoverage(all));
}

TEST(Acceptance, OverlapIsThinnedOut)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  ExtractionOptions options = makeOptions(0.08, 0.04);
  const std::size_t all =
      extractPatches(cloud, makeSensor(kCamera), options).patches.size();
  options.max_overlap = 0.3;
  const ExtractionResult few = extractPatches(cloud, makeSensor(kCamera), options);
  EXPECT_LT(few.patches.size(), all / 2);
  EXPECT_FALSE(few.notices.empty());
  options.max_overlap = 1.5;
  EXPECT_THROW(extractPatches(cloud, makeSensor(kCamera), options),
               std::invalid_argument);
}

TEST(ExtractWhole, FitsOnePlaneToAWall)
{
  Random random;
  const RangeCloud cloud = makeOrganizedCloud(kCamera, [&](int, int) {
    return 1.0 + 0.002 * random.normal();
  });
  ExtractionOptions options = makeOptions();
  options.fit.surface = SurfaceRequest::Plane;
  const ExtractionResult result = extractWhole(cloud, makeSensor(kCamera), options);
  ASSERT_EQ(result.patches.size(), 1U);
  const ExtractedPatch& p = result.patches[0];
  EXPECT_FALSE(p.seed_index);
  EXPECT_EQ(p.fit.points, 160 * 120);
  // 2 mm over 19200 points leaves 0.014 mm.
  EXPECT_NEAR(p.fit.patch.c.z(), 1.0, 1e-4);
  EXPECT_LT(p.fit.patch.normal().z(), -0.999);
}

/// A can of 33 mm radius seen from all sides, about the origin.
RangeCloud
makeCan(Random& random)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < 4000; ++i) {
    const double angle = random.uniform(-3.14159265, 3.14159265);
    const double radius = 0.033 + 0.0005 * random.normal();
    points->push_back({static_cast<float>(radius * std::cos(angle)),
                       static_cast<float>(radius * std::sin(angle)),
                       static_cast<float>(random.uniform(-0.06, 0.06))});
  }
  return {points, {}, {}};
}

TEST(UnknownSensor, ScansFromAllSidesGetConstantNoiseAndANotice)
{
  Random random;
  const RangeCloud can = makeCan(random);
  const ExtractionOptions options = makeOptions(0.015, 0.02);
  const ExtractionResult result = extractPatches(can, makeSensor(kCamera), options);
  // Of the noise and of the viewpoint.
  ASSERT_EQ(result.notices.size(), 2U);
  for (const std::string& notice : result.notices)
    EXPECT_EQ(notice.find('\n'), std::string::npos);
  EXPECT_FALSE(result.viewpoint_is_credible);
  EXPECT_EQ(result.points.used, result.points.in_cloud);
  EXPECT_GT(result.patches.size(), 20U);

  Sensor constant = makeSensor(kCamera);
  constant.noise = std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{0.001, 0.001});
  ExtractionResult chosen = extractPatches(can, constant, options);
  EXPECT_EQ(chosen.notices.size(), 1U); // the noise was chosen
  chosen.notices = result.notices;
  expectSameBits(chosen, result);
}

TEST(UnknownSensor, FewPointsBehindTheCameraAreLeftOut)
{
  Random random;
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < 500; ++i)
    points->push_back({static_cast<float>(random.uniform(-0.1, 0.1)),
                       static_cast<float>(random.uniform(-0.1, 0.1)),
                       static_cast<float>(1.0 + 0.002 * random.normal())});
  points->push_back({0.0F, 0.0F, -0.5F});
  points->push_back({0.0F, 0.0F, 0.0F});
  const ExtractionResult result =
      extractWhole({points, {}, {}}, makeSensor(kCamera), makeOptions());
  EXPECT_EQ(
      result.notices,
      std::vector<std::string>{"2 of 502 points are left out: 2 behind the camera"});
  EXPECT_EQ(result.points.behind_camera, 2);
  ASSERT_EQ(result.patches.size(), 1U);
  EXPECT_EQ(result.patches[0].fit.points, 500);
  EXPECT_EQ(result.patches[0].fit.invalid_points, 0);
}

TEST(Degenerate, CloudsWithTooFewPointsGiveAStatus)
{
  const Sensor sensor = makeSensor(kCamera);
  const ExtractionOptions options = makeOptions();
  const auto empty = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  const RangeCloud all_nan =
      makeOrganizedCloud(kCamera, [](int, int) { return std::nan(""); });
  auto point = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  point->push_back({0.0F, 0.0F, 1.0F});
  const std::map<FitStatus, int> one_too_few{{FitStatus::TooFewPoints, 1}};
  for (const RangeCloud& cloud : {RangeCloud{empty, {}, {}}, all_nan}) {
    const ExtractionResult result = extractPatches(cloud, sensor, options);
    EXPECT_TRUE(result.patches.empty());
    EXPECT_TRUE(result.rejected.empty());
    EXPECT_EQ(extractWhole(cloud, sensor, options).rejected, one_too_few);
  }
  const RangeCloud alone{point, {}, {}};
  EXPECT_EQ(extractPatches(alone, sensor, options).rejected, one_too_few);
  EXPECT_EQ(extractWhole(alone, sensor, options).rejected, one_too_few);
}

TEST(Misuse, Throws)
{
  Random random;
  const RangeCloud cloud = makeRollingCloud(random);
  const auto expectThrow =
      [](const RangeCloud& c, const Sensor& sensor, const ExtractionOptions& options) {
        EXPECT_THROW(extractPatches(c, sensor, options), std::invalid_argument);
      };
  const Sensor sensor = makeSensor(kCamera);
  ExtractionOptions options = makeOptions();
  options.threads = -1;
  expectThrow(cloud, sensor, options);
  options = makeOptions();
  options.sampler.radius_m = -1.0;
  expectThrow(cloud, sensor, options);
  options = makeOptions();
  options.fit.containment = 2.0;
  expectThrow(cloud, sensor, options);
  EXPECT_THROW(extractWhole(cloud, sensor, options), std::invalid_argument);
  expectThrow({}, sensor, makeOptions());
  Sensor silent = sensor;
  silent.noise = nullptr;
  expectThrow(cloud, silent, makeOptions());
}

}} // namespace holdfast
