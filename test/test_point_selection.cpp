// What becomes of the points that people bring: other axes, other units, points that
// were never measured, points that are there twice. Nothing is left out in silence, and
// every point is counted once.
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/linear_noise_model.h>

#include <cmath>
#include <numeric>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeSensor;
using test::Random;

using Points = pcl::PointCloud<pcl::PointXYZ>;

const Camera kCamera = makeCamera(160, 120, 150.0);

int
sum(const PointAccounting& p)
{
  return p.invalid + p.behind_camera + p.out_of_view + p.invalid_covariance +
         p.duplicate + p.used;
}

bool
isNoted(const ExtractionResult& result, const std::string& words)
{
  return std::any_of(result.notices.begin(),
                     result.notices.end(),
                     [&words](const std::string& notice) {
                       return notice.find(words) != std::string::npos;
                     });
}

ExtractionOptions
makeOptions()
{
  ExtractionOptions options;
  options.sampler.radius_m = 0.06;
  options.sampler.spacing_m = 0.1;
  options.threads = 1;
  return options;
}

/// A wall and a floor in front of the camera.
RangeCloud
makeRoom(Random& random)
{
  return test::makeOrganizedCloud(kCamera, [&random](int, int v) {
    const double floor = v > 60 ? 150.0 / (v - 59.5) : 1e9;
    return std::min(2.0, floor) + 0.002 * random.normal();
  });
}

/// The cloud with every point changed.
template <typename Change>
RangeCloud
changed(const RangeCloud& cloud, bool organized, const Change& change)
{
  RangeCloud result = cloud;
  const auto points = pcl::make_shared<Points>(*cloud.points);
  for (pcl::PointXYZ& p : *points)
    p.getVector3fMap() = change(Eigen::Vector3f(p.getVector3fMap()));
  if (!organized) {
    points->width = static_cast<std::uint32_t>(points->size());
    points->height = 1;
  }
  result.points = points;
  return result;
}

ExtractionResult
extract(const RangeCloud& cloud)
{
  Sensor sensor = makeSensor(kCamera);
  sensor.min_range_m = 0.5;
  sensor.max_range_m = 8.0;
  const ExtractionResult result = extractPatches(cloud, sensor, makeOptions());
  EXPECT_EQ(sum(result.points), result.points.in_cloud);
  EXPECT_EQ(result.points.in_cloud, static_cast<int>(cloud.points->size()));
  return result;
}

class Foreign : public testing::TestWithParam<bool> {}; ///< organized?

TEST_P(Foreign, AxesAreRecognised)
{
  Random random;
  const RangeCloud room = makeRoom(random);
  const auto opengl =
      changed(room, GetParam(), [](const Eigen::Vector3f& q) -> Eigen::Vector3f {
        return {q.x(), -q.y(), -q.z()};
      });
  const ExtractionResult back = extract(opengl);
  EXPECT_TRUE(isNoted(back, "--axes opengl"));
  EXPECT_TRUE(isNoted(back, "behind the sensor"));
  EXPECT_FALSE(back.viewpoint_is_credible);
  const auto ros =
      changed(room, GetParam(), [](const Eigen::Vector3f& q) -> Eigen::Vector3f {
        return {q.z(), -q.x(), -q.y()};
      });
  EXPECT_TRUE(isNoted(extract(ros), "--axes ros"));
  EXPECT_FALSE(isNoted(extract(room), "--axes"));
}

TEST(Foreign, AxesThatWereRightAreNotTurnedAgain)
{
  Random random;
  RangeCloud room = makeRoom(random);
  for (const CloudAxes axes : {CloudAxes::OpenGl, CloudAxes::Ros}) {
    room.sensor_pose.R = turnFromCamera(axes);
    room.sensor_pose_given = true;
    const ExtractionResult result = extract(room);
    EXPECT_TRUE(isNoted(result, "or is wrong where it was given") ||
                isNoted(result, "as --axes ros turns them"));
  }
}

TEST_P(Foreign, UnitsAreRecognised)
{
  Random random;
  const RangeCloud room = makeRoom(random);
  const std::vector<std::pair<float, std::string>> units{{1e3F, "--unit mm"},
                                                         {1e2F, "--unit cm"},
                                                         {1e6F, "--unit um"}};
  for (const auto& [factor, option] : units) {
    const float f = factor;
    const auto scaled =
        changed(room, GetParam(), [f](const Eigen::Vector3f& q) -> Eigen::Vector3f {
          return f * q;
        });
    const ExtractionResult result = extract(scaled);
    EXPECT_TRUE(isNoted(result, option)) << option;
    for (const auto& [ignored, other] : units)
      EXPECT_EQ(isNoted(result, other), other == option) << other;
  }
}

INSTANTIATE_TEST_SUITE_P(Layouts, Foreign, testing::Bool());

TEST(Foreign, AxesAndUnitsTogetherAreRecognised)
{
  Random random;
  const auto both =
      changed(makeRoom(random), false, [](const Eigen::Vector3f& q) -> Eigen::Vector3f {
        return {1e3F * q.z(), -1e3F * q.x(), -1e3F * q.y()};
      });
  const ExtractionResult result = extract(both);
  EXPECT_TRUE(isNoted(result, "--axes ros"));
  EXPECT_TRUE(isNoted(result, "--unit mm"));
}

TEST(Foreign, TheSensorOfTheResultIsTheOneWhoseNoiseWasUsed)
{
  Random random;
  const RangeCloud room = makeRoom(random);
  EXPECT_EQ(extract(room).sensor.name, makeSensor(kCamera).name);
  const auto behind =
      changed(room, false, [](const Eigen::Vector3f& q) -> Eigen::Vector3f {
        return -q;
      });
  EXPECT_EQ(extract(behind).sensor.noise->name(), "constant");
}

TEST(Points, InPartOutOfViewAreCountedByReason)
{
  Random random;
  RangeCloud room =
      changed(makeRoom(random), false, [](const Eigen::Vector3f& q) { return q; });
  const auto points = pcl::make_shared<Points>(*room.points);
  for (int i = 0; i < 100; ++i)
    (*points)[i] = {0.1F, 0.001F * static_cast<float>(i), -1.0F};
  for (int i = 100; i < 150; ++i)
    (*points)[i] = {0.1F, 0.001F * static_cast<float>(i), 1e4F};
  for (int i = 150; i < 170; ++i)
    (*points)[i].x = test::kNaN;
  room.points = points;
  const ExtractionResult result = extract(room);
  EXPECT_EQ(result.points.behind_camera, 100);
  EXPECT_EQ(result.points.out_of_view, 50);
  EXPECT_EQ(result.points.invalid, 20);
  EXPECT_TRUE(isNoted(result, "100 behind the camera, 50 out of the sensor's view"));
  EXPECT_GT(result.patches.size(), 50U);
}

TEST(Points, ThatAreThereTwiceCountOnce)
{
  Random random;
  const RangeCloud once =
      changed(makeRoom(random), false, [](const Eigen::Vector3f& q) { return q; });
  RangeCloud twice = once;
  const auto points = pcl::make_shared<Points>(*once.points);
  *points += *once.points;
  twice.points = points;
  const ExtractionResult a = extract(once);
  const ExtractionResult b = extract(twice);
  EXPECT_EQ(a.points.duplicate, 0);
  EXPECT_EQ(b.points.duplicate, a.points.used);
  EXPECT_TRUE(isNoted(b, "50 %"));
  ASSERT_EQ(a.patches.size(), b.patches.size());
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    EXPECT_EQ(a.patches[i].fit.points, b.patches[i].fit.points);
    EXPECT_TRUE(a.patches[i].fit.covariance == b.patches[i].fit.covariance);
  }
}

TEST(Points, OfEnlargedImagesCountOnce)
{
  Random random;
  const RangeCloud room = makeRoom(random);
  for (const auto& [columns, rows] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{2, 1}, {1, 2}, {2, 2}}) {
    const auto points = pcl::make_shared<Points>(columns * room.points->width,
                                                 rows * room.points->height);
    for (std::uint32_t v = 0; v < points->height; ++v)
      for (std::uint32_t u = 0; u < points->width; ++u)
        (*points)(u, v) = (*room.points)(u / columns, v / rows);
    RangeCloud enlarged = room;
    enlarged.points = points;
    const ExtractionResult result = extract(enlarged);
    EXPECT_EQ(result.points.used, static_cast<int>(room.points->size()));
    EXPECT_TRUE(isNoted(result, "lie exactly where others do"));
    EXPECT_GT(result.patches.size(), 50U); // though no pixel touches another
  }
  EXPECT_EQ(extract(room).points.duplicate, 0);
}

TEST(Points, PlusAndMinusZeroAreTheSamePlace)
{
  RangeCloud cloud;
  const auto points = pcl::make_shared<Points>();
  for (int i = 0; i < 30; ++i)
    points->push_back(
        {0.01F * static_cast<float>(i % 6), 0.01F * static_cast<float>(i / 6), 1.0F});
  points->push_back({-0.0F, -0.0F, 1.0F});
  cloud.points = points;
  EXPECT_EQ(extract(cloud).points.duplicate, 1);
}

TEST(Seeds, WithoutNeighborsEndEarlyWithAdvice)
{
  Random random;
  const auto sparse =
      changed(makeRoom(random), false, [](const Eigen::Vector3f& q) { return q; });
  ExtractionOptions options = makeOptions();
  options.sampler.radius_m = 1e-4;
  options.sampler.spacing_m = 0.02;
  const ExtractionResult result = extractPatches(sparse, makeSensor(kCamera), options);
  EXPECT_TRUE(result.patches.empty());
  EXPECT_TRUE(isNoted(result, "are not tried"));
  EXPECT_TRUE(isNoted(result, "radius"));
  int tried = 0;
  for (const auto& [status, count] : result.rejected)
    tried += count;
  EXPECT_LE(tried, 64);
}

TEST(Seeds, WhoseNeighborhoodsAreTheWholeCloudAreTriedOnce)
{
  Random random;
  const auto room =
      changed(makeRoom(random), false, [](const Eigen::Vector3f& q) { return q; });
  ExtractionOptions options = makeOptions();
  options.sampler.radius_m = 50.0;
  options.sampler.spacing_m = 0.02;
  const ExtractionResult result = extractPatches(room, makeSensor(kCamera), options);
  EXPECT_TRUE(isNoted(result, "larger than the cloud"));
  EXPECT_LE(result.patches.size(), 1U);
}

TEST(Seeds, OfAnImageWithLonePixelsLikewise)
{
  Random random;
  RangeCloud room = makeRoom(random);
  const auto points = pcl::make_shared<Points>(*room.points);
  for (std::uint32_t u = 1; u < 30; u += 2) // each on its own
    for (std::uint32_t v = 0; v < 2; ++v) {
      (*points)(u - 1, v).z = test::kNaN;
      (*points)(u, 1).z = test::kNaN;
    }
  room.points = points;
  ExtractionOptions options = makeOptions();
  options.sampler.radius_m = 50.0;
  const ExtractionResult result = extractPatches(room, makeSensor(kCamera), options);
  EXPECT_TRUE(isNoted(result, "larger than the cloud"));
  EXPECT_LE(result.patches.size(), 1U);
}

/// Points all over a sphere around the origin.
RangeCloud
makeModel(Random& random)
{
  const auto points = pcl::make_shared<Points>();
  for (int i = 0; i < 6000; ++i) {
    const Eigen::Vector3d q = 0.3 * random.unitVector();
    points->push_back({static_cast<float>(q.x()),
                       static_cast<float>(q.y()),
                       static_cast<float>(q.z())});
  }
  RangeCloud cloud;
  cloud.points = points;
  return cloud;
}

TEST(Viewpoint, OfASpinningScannerIsWithinItsCloud)
{
  Random random;
  const RangeCloud hall =
      changed(makeModel(random),
              false,
              [](const Eigen::Vector3f& q) -> Eigen::Vector3f { return 20.0F * q; });
  Sensor scanner = makeSensor(kCamera);
  scanner.noise =
      std::make_shared<const LinearNoiseModel>(LinearNoiseModel::Parameters{});
  ASSERT_TRUE(scanner.noise->isOmnidirectional());
  const ExtractionResult result = extractPatches(hall, scanner, makeOptions());
  EXPECT_TRUE(result.viewpoint_is_credible);
  EXPECT_FALSE(isNoted(result, "--viewpoint"));
}

TEST(Viewpoint, InsideAModelIsDoubtedUnlessGiven)
{
  Random random;
  RangeCloud model = makeModel(random);
  ExtractionOptions options = makeOptions();
  const auto run = [&] {
    return extractPatches(model,
                          withConstantNoise(makeSensor(kCamera), 0.001),
                          options);
  };
  ExtractionResult result = run();
  EXPECT_FALSE(result.viewpoint_is_credible);
  EXPECT_TRUE(isNoted(result, "--orient"));
  options.normal_side = NormalSide::Outward;
  result = run();
  EXPECT_FALSE(isNoted(result, "--orient"));
  EXPECT_GT(result.patches.size(), 30U);
  for (const ExtractedPatch& p : result.patches) {
    EXPECT_GT(p.fit.patch.normal().dot(p.fit.patch.c), 0.0);
    EXPECT_LT(p.fit.patch.principalCurvatures().sum(), 0.0); // bumps, not bowls
  }
  options.normal_side = NormalSide::Up;
  for (const ExtractedPatch& p : run().patches)
    EXPECT_GE(p.fit.patch.normal().z(), 0.0);
  options.normal_side = NormalSide::Viewpoint;
  model.sensor_pose.c = {0.0, 0.0, 2.0};
  model.sensor_pose_given = true;
  result = run();
  EXPECT_TRUE(result.viewpoint_is_credible);
  for (const ExtractedPatch& p : result.patches) {
    // Not at the silhouette: the points decide the side, and the centre may lie
    // elsewhere.
    const Eigen::Vector3d ray = (model.sensor_pose.c - p.fit.patch.c).normalized();
    EXPECT_GT(p.fit.patch.normal().dot(ray), -0.1);
  }
}

TEST(Grid, ThatIsNoCamerasIsNoted)
{
  Random random;
  const RangeCloud room = makeRoom(random);
  const auto mirrored = pcl::make_shared<Points>(*room.points);
  for (int v = 0; v < kCamera.height; ++v)
    for (int u = 0; u < kCamera.width; ++u)
      (*mirrored)(u, v) = (*room.points)(u, kCamera.height - 1 - v);
  RangeCloud cloud = room;
  cloud.points = mirrored;
  EXPECT_TRUE(isNoted(extract(cloud), "patches are not cut at jumps"));
  EXPECT_FALSE(isNoted(extract(room), "not cut"));
}

}} // namespace holdfast
