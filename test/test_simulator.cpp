#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/sensor/constant_noise_model.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/simulation/simulator.h>

#include "support/random.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace holdfast { namespace {

Sensor
kinect()
{
  Sensor sensor;
  sensor.name = "kinect";
  sensor.noise = std::make_shared<StereoNoiseModel>(StereoNoiseModel::Parameters{});
  sensor.min_range_m = 0.5;
  sensor.max_range_m = 8.0;
  sensor.disparity_quantum_px = 0.125;
  return sensor;
}

int
countHits(const RangeImage& image)
{
  return static_cast<int>(std::count_if(image.hits.begin(),
                                        image.hits.end(),
                                        [](int hit) { return hit >= 0; }));
}

/// Whether all arrays have one entry per pixel and NaN stands exactly where nothing was
/// hit.
void
expectConsistent(const RangeImage& image)
{
  const std::size_t n =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  ASSERT_EQ(image.directions.size(), n);
  ASSERT_EQ(image.hits.size(), n);
  ASSERT_EQ(image.truth.size(), n);
  ASSERT_EQ(image.points.size(), n);
  ASSERT_EQ(image.covariances.size(), n);
  ASSERT_EQ(image.roots.size(), n);
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_EQ(image.hits[i] >= 0, image.truth[i].allFinite());
    EXPECT_EQ(image.hits[i] < 0, image.truth[i].array().isNaN().all());
    EXPECT_EQ(image.points[i].allFinite(), image.truth[i].allFinite());
  }
}

class ReferenceScenes : public testing::TestWithParam<PatchType> {};

TEST_P(ReferenceScenes, HitsLieOnTheBoundedSurface)
{
  for (const ReferenceScene& view :
       {tableTwoScene(GetParam()), robotScene(GetParam(), 1.0, 0.5, 0.6)}) {
    const Patch& patch = view.scene.patches.front();
    ASSERT_EQ(validityError(patch), "");
    const RangeImage image = castRays(view.scene, view.rays);
    expectConsistent(image);
    // Enough to fit eleven parameters with redundancy.
    EXPECT_GT(countHits(image), 50) << view.scene.name;
    for (std::size_t i = 0; i < image.truth.size(); ++i) {
      if (image.hits[i] < 0)
        continue;
      // Rounding of coordinates of up to 6 m, squared and multiplied by kappa.
      EXPECT_NEAR(implicitValue(patch, image.truth[i]), 0.0, 1e-12);
      const Eigen::Vector3d local = patch.pose().toLocal(image.truth[i]);
      EXPECT_TRUE(contains(patch, (1.0 - 1e-12) * local.head<2>()));
      const Eigen::Vector3d ray = image.truth[i] - image.sensor_pose.c;
      EXPECT_NEAR(ray.cross(image.directions[i]).norm(), 0.0, 1e-14 * ray.norm() * 10);
      EXPECT_GT(ray.dot(image.directions[i]), 0.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         ReferenceScenes,
                         testing::ValuesIn(kPatchTypes),
                         [](const auto& test) {
                           return std::string(surfaceName(test.param.surface)) + "_" +
                                  std::string(boundaryName(test.param.boundary));
                         });

TEST(RobotScene, SensorStandsWhereAskedAndLooksAtThePatch)
{
  const PatchType type = kPatchTypes.front();
  const Pose pose = robotScene(type, 0.8, 0.3, 1.0).scene.sensor_pose;
  EXPECT_NEAR(pose.c.norm(), 0.8, 1e-15);
  EXPECT_NEAR(std::acos(pose.c.z() / 0.8), 0.3, 1e-14);
  EXPECT_NEAR(std::atan2(pose.c.y(), pose.c.x()), 1.0, 1e-14);
  EXPECT_NEAR((pose.toLocal({0, 0, 0}) - Eigen::Vector3d(0, 0, 0.8)).norm(),
              0.0,
              1e-14);
  EXPECT_THROW(robotScene(type, 0.0, 0.3, 1.0), std::invalid_argument);
  EXPECT_THROW(robotScene(type, 1.0, 1.6, 1.0), std::invalid_argument);
  EXPECT_THROW(robotScene(type, 1.0, -0.1, 1.0), std::invalid_argument);
  EXPECT_THROW(robotScene({SurfaceType::Sphere, BoundaryType::Quad}, 1.0, 0.3, 1.0),
               std::invalid_argument);
}

/// Whether t is a hit of the shape whose implicit function changes sign there first:
/// checked by walking along the ray in small steps.
template <typename Function>
void
expectFirstCrossing(const Function& g, double end, std::optional<double> t)
{
  constexpr int kSteps = 3000;
  std::optional<double> crossing;
  for (int i = 0; i < kSteps && !crossing; ++i)
    if (g(end * i / kSteps) > 0.0 && g(end * (i + 1) / kSteps) <= 0.0)
      crossing = end * i / kSteps;
  if (crossing) {
    ASSERT_TRUE(t.has_value());
    EXPECT_GE(*t, *crossing - 1e-12);
    EXPECT_LE(*t, *crossing + end / kSteps + 1e-12);
  }
  if (t) {
    // Rounding of a point of order one; slopes are of order one.
    EXPECT_NEAR(g(*t), 0.0, 1e-13);
  }
}

TEST(Shapes, TerrainIsHitAtItsHeight)
{
  test::Random random;
  const Terrain terrain({0.3, -0.2, 0.1}, 4.0, 0.08, 0.6, 5);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d origin(random.uniform(-1.0, 1.0),
                                 random.uniform(-1.0, 1.0),
                                 random.uniform(0.3, 2.0));
    const Eigen::Vector3d target(random.uniform(-1.2, 1.8),
                                 random.uniform(-1.7, 1.3),
                                 0.1);
    const Eigen::Vector3d direction = target - origin;
    const auto t = terrain.intersect(origin, direction);
    ASSERT_TRUE(t.has_value());
    expectFirstCrossing(
        [&](double s) {
          const Eigen::Vector3d q = origin + s * direction;
          return q.z() - terrain.heightAt(q.x(), q.y());
        },
        2.0,
        t);
  }
  EXPECT_FALSE(terrain.intersect({0, 0, 1}, {0, 0, 1}).has_value());
  EXPECT_FALSE(terrain.intersect({5, 0, 1}, {0, 0, -1}).has_value());
}

TEST(Shapes, FlatTerrainIsAPlane)
{
  const Terrain flat({0, 0, 0.25}, 2.0, 0.0, 1.0, 1);
  const auto t = flat.intersect({0.5, 0.5, 1.25}, {0, 0, -2});
  ASSERT_TRUE(t.has_value());
  EXPECT_NEAR(*t, 0.5, 1e-15);
}

TEST(Shapes, BoulderIsHitOnItsBumpySurface)
{
  test::Random random;
  const Pose pose{random.rotation(), random.uniformVector(-1.0, 1.0)};
  const Boulder boulder(pose, {0.3, 0.2, 0.25}, 0.15, 9);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d origin = pose.c + 1.5 * random.unitVector();
    const Eigen::Vector3d direction =
        pose.c + 0.3 * random.unitVector() * random.uniform(0.0, 1.0) - origin;
    const auto t = boulder.intersect(origin, direction);
    hits += t.has_value() ? 1 : 0;
    expectFirstCrossing(
        [&](double s) { return boulder.implicitValue(origin + s * direction); },
        2.0,
        t);
  }
  EXPECT_GT(hits, 200);
}

TEST(Shapes, BoulderIsBumpyAndReproducible)
{
  const Pose pose;
  const Boulder a(pose, {1, 1, 1}, 0.2, 1);
  const Boulder same(pose, {1, 1, 1}, 0.2, 1);
  const Boulder other(pose, {1, 1, 1}, 0.2, 2);
  double low = 1.0, high = -1.0;
  test::Random random;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d q = random.unitVector();
    EXPECT_EQ(a.implicitValue(q), same.implicitValue(q));
    EXPECT_LE(std::abs(a.implicitValue(q)), 0.2 + 1e-12);
    low = std::min(low, a.implicitValue(q));
    high = std::max(high, a.implicitValue(q));
  }
  EXPECT_GT(high - low, 0.1);
  EXPECT_NE(a.implicitValue({1, 0, 0}), other.implicitValue({1, 0, 0}));
}

TEST(Shapes, BallBoxAndPipeAreHitWhereGeometrySays)
{
  const Ball ball({1, 0, 0}, 0.5);
  EXPECT_NEAR(ball.intersect({0, 0, 0}, {2, 0, 0}).value(), 0.25, 1e-15);
  EXPECT_NEAR(ball.intersect({1, 0, 0}, {0, 1, 0}).value(), 0.5, 1e-15)
      << "from inside";
  EXPECT_FALSE(ball.intersect({0, 0, 0}, {-1, 0, 0}).has_value()) << "behind";
  EXPECT_FALSE(ball.intersect({0, 0.6, 0}, {1, 0, 0}).has_value());

  Pose turned;
  turned.R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  turned.c = {0, 0, 1};
  const Box box(turned, {2, 1, 1}); // 1 along world x, 2 along world y
  EXPECT_NEAR(box.intersect({-2, 0.9, 1}, {1, 0, 0}).value(), 1.5, 1e-15);
  EXPECT_FALSE(box.intersect({-2, 1.1, 1}, {1, 0, 0}).has_value());
  EXPECT_NEAR(box.intersect({0, 0, 1}, {0, 1, 0}).value(), 1.0, 1e-15) << "from inside";
  EXPECT_FALSE(box.intersect({-2, 0, 1}, {-1, 0, 0}).has_value()) << "behind";

  const Pipe pipe({0, 0, 0}, {0, 3, 0}, 0.1, 2.0);
  EXPECT_NEAR(pipe.intersect({-1, 0.9, 0}, {1, 0, 0}).value(), 0.9, 1e-15);
  EXPECT_FALSE(pipe.intersect({-1, 1.1, 0}, {1, 0, 0}).has_value()) << "past its end";
  EXPECT_FALSE(pipe.intersect({0.05, -3, 0}, {0, 1, 0}).has_value()) << "through it";
  // In through the open end at y = -1, onto the wall at x = 0.1.
  EXPECT_NEAR(pipe.intersect({0, -1.5, 0}, {0.1, 1, 0}).value(), 1.0, 1e-14);
}

TEST(Shapes, RefuseImpossibleSizes)
{
  EXPECT_THROW(Ball({0, 0, 0}, 0.0), std::invalid_argument);
  EXPECT_THROW(Box({}, {1, -1, 1}), std::invalid_argument);
  EXPECT_THROW(Pipe({0, 0, 0}, {0, 0, 0}, 1.0, 1.0), std::invalid_argument);
  EXPECT_THROW(Terrain({0, 0, 0}, 1.0, -0.1, 1.0, 1), std::invalid_argument);
  EXPECT_THROW(Boulder({}, {1, 1, 1}, 0.5, 1), std::invalid_argument);
}

TEST(Scenes, NearestSurfaceHidesTheOthers)
{
  Scene scene;
  scene.shapes = {std::make_shared<Ball>(Eigen::Vector3d(0, 0, 5), 1.0),
                  std::make_shared<Ball>(Eigen::Vector3d(0, 0, 3), 0.5)};
  const auto hit = firstHit(scene, {0, 0, 0}, {0, 0, 1});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->index, 1);
  EXPECT_DOUBLE_EQ(hit->t, 2.5);
  EXPECT_FALSE(firstHit(scene, {0, 0, 0}, {1, 0, 0}).has_value());
}

TEST(Scenes, FirstHitIsTheNearestOfAllShapes)
{
  for (const char* name : {"rocks", "mix", "table", "boulder_field", "stairway"}) {
    SCOPED_TRACE(name);
    const Scene scene = makeScene(name);
    test::Random random;
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Vector3d origin(random.uniform(-2, 2),
                                   random.uniform(-2, 2),
                                   random.uniform(-0.1, 2));
      const Eigen::Vector3d direction = random.uniform(0.1, 3.0) * random.unitVector();
      std::optional<double> nearest;
      for (const auto& shape : scene.shapes) {
        const auto t = shape->intersect(origin, direction);
        if (!t)
          continue;
        EXPECT_GE(*t, shape->nearestPossible(origin, direction));
        nearest = nearest ? std::min(*nearest, *t) : *t;
      }
      const auto hit = firstHit(scene, origin, direction);
      ASSERT_EQ(hit.has_value(), nearest.has_value());
      if (hit) {
        EXPECT_EQ(hit->t, *nearest);
      }
    }
  }
}

TEST(Scenes, AllAreSeenFromTheDistanceAsked)
{
  const Camera camera;
  for (const std::string& name : sceneNames()) {
    SCOPED_TRACE(name);
    for (const double distance : {0.9, 1.6}) {
      const Scene scene = makeScene(name, distance);
      EXPECT_EQ(scene.name, name);
      EXPECT_FALSE(scene.sensor_pose.R.isIdentity(0.1));
      const RangeImage image = castRays(scene, pixelRays(camera, 16), 0.5, 8.0);
      expectConsistent(image);
      EXPECT_GT(countHits(image), 4);
      // The middle of the picture shows the scene about that far away.
      const auto middle = image.truth[image.truth.size() / 2 +
                                      static_cast<std::size_t>(image.width) / 2];
      ASSERT_TRUE(middle.allFinite());
      EXPECT_NEAR((middle - scene.sensor_pose.c).norm(), distance, 0.3);
    }
  }
}

TEST(Scenes, NamesMayBeWrittenWithDashes)
{
  EXPECT_EQ(makeScene("plane-quad").name, "plane_quad");
  EXPECT_EQ(makeScene("plane-quad").patches.front().type.boundary, BoundaryType::Quad);
  EXPECT_THROW(makeScene("moon"), std::invalid_argument);
  EXPECT_THROW(makeScene("rocks", 0.0), std::invalid_argument);
  EXPECT_THROW(makeScene("rocks", -1.0), std::invalid_argument);
}

TEST(Scenes, DefaultDistances)
{
  EXPECT_NEAR(makeScene("sphere").sensor_pose.c.norm(), 1.0, 1e-15);
  const Pose rocks = makeScene("rocks").sensor_pose;
  EXPECT_NEAR((rocks.c - makeScene("rocks", 2.2).sensor_pose.c).norm(), 1.0, 1e-14);
}

TEST(RangeImages, PointsOutOfRangeAreMissingButStillHide)
{
  Scene scene;
  scene.shapes = {std::make_shared<Ball>(Eigen::Vector3d(0, 0, 5), 1.0),
                  std::make_shared<Ball>(Eigen::Vector3d(0, 0, 1), 0.7)};
  RayGrid middle{1, 1, {{0, 0, 1}}};
  EXPECT_EQ(castRays(scene, middle).hits.front(), 1);
  EXPECT_EQ(castRays(scene, middle, 0.5).hits.front(), -1);
  scene.shapes.pop_back();
  EXPECT_EQ(castRays(scene, middle, 0.5, 8.0).hits.front(), 0);
  EXPECT_EQ(castRays(scene, middle, 0.5, 3.0).hits.front(), -1);
}

TEST(Noise, HasTheCovarianceOfTheModel)
{
  test::Random random;
  const Sensor sensor = kinect();
  const ReferenceScene view = robotScene(kPatchTypes.front(), 1.0, 0.5, 0.6);
  RangeImage image = castRays(view.scene, view.rays);
  constexpr double kScale = 0.7;
  attachNoise(image, *sensor.noise, kScale);
  const int hits = countHits(image);
  constexpr int kDraws = 200;
  double sum = 0.0;
  Eigen::Matrix3d whitened = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> points;
  for (int draw = 0; draw < kDraws; ++draw) {
    drawNoise(image.truth, image.roots, random.engine(), points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (image.hits[i] < 0)
        continue;
      // In the camera frame, by the model itself: checks frame and scale as well.
      const Pose& pose = image.sensor_pose;
      const Eigen::Matrix3d Sigma =
          kScale * kScale * sensor.noise->covariance(pose.toLocal(image.truth[i]));
      const Eigen::Vector3d error = pose.R.transpose() * (points[i] - image.truth[i]);
      const Eigen::Vector3d white = Sigma.llt().matrixL().solve(error);
      sum += white.squaredNorm();
      whitened += white * white.transpose();
    }
  }
  const double n = static_cast<double>(hits) * kDraws;
  // The sum is chi-square with 3 n degrees of freedom, of relative standard deviation
  // sqrt(2 / (3 n)); entries of the mean outer product have sqrt(2 / n) at most. Five
  // standard deviations each.
  EXPECT_NEAR(sum / (3.0 * n), 1.0, 5.0 * std::sqrt(2.0 / (3.0 * n)));
  EXPECT_LT((whitened / n - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(),
            5.0 * std::sqrt(2.0 / n));
}

TEST(Noise, RootsBelongToTheCovariances)
{
  const ReferenceScene view = tableTwoScene(kPatchTypes.front());
  RangeImage image = castRays(view.scene, view.rays);
  attachNoise(image, *kinect().noise);
  for (std::size_t i = 0; i < image.roots.size(); ++i)
    EXPECT_LE(
        (image.roots[i] * image.roots[i].transpose() - image.covariances[i]).norm(),
        1e-12 * image.covariances[i].norm());
}

TEST(Noise, IsReproducibleFromTheSeed)
{
  const Scene scene = makeScene("sphere");
  const Sensor sensor = kinect();
  const RayGrid rays = pixelRays(sensor.camera, 8);
  const auto draw = [&](std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    return simulate(scene, rays, sensor, {}, generator);
  };
  const RangeImage first = draw(7), again = draw(7), other = draw(8);
  expectConsistent(first);
  int differences = 0;
  for (std::size_t i = 0; i < first.points.size(); ++i) {
    if (first.hits[i] < 0)
      continue;
    EXPECT_EQ(first.points[i], again.points[i]);
    EXPECT_EQ(first.truth[i], other.truth[i]);
    differences += first.points[i] != other.points[i] ? 1 : 0;
  }
  EXPECT_EQ(differences, countHits(first));
}

TEST(Noise, OfAPerfectSensorIsZero)
{
  Sensor sensor = kinect();
  sensor.noise =
      std::make_shared<ConstantNoiseModel>(ConstantNoiseModel::Parameters{0.0, 0.0});
  std::mt19937_64 generator(1);
  const RangeImage image =
      simulate(makeScene("mix"), pixelRays(sensor.camera, 16), sensor, {}, generator);
  for (std::size_t i = 0; i < image.points.size(); ++i) {
    if (image.hits[i] >= 0) {
      EXPECT_EQ(image.points[i], image.truth[i]);
    }
  }
}

TEST(Noise, ArgumentsAreChecked)
{
  RangeImage image = castRays(makeScene("ball"), frustumRays(2, 0.1));
  EXPECT_THROW(attachNoise(image, *kinect().noise, -1.0), std::invalid_argument);
  std::mt19937_64 generator(1);
  std::vector<Eigen::Vector3d> out;
  EXPECT_THROW(drawNoise(image.truth, {}, generator, out), std::invalid_argument);
}

TEST(Quantization, PutsDisparitiesOnStepsAndKeepsRays)
{
  const Sensor sensor = kinect();
  const double fb = sensor.disparity_focal_px * sensor.baseline_m;
  const Scene scene = makeScene("rocks", 1.5);
  const RayGrid rays = pixelRays(sensor.camera, 16);
  std::mt19937_64 generator(3);
  const RangeImage noisy = simulate(scene, rays, sensor, {}, generator);
  std::mt19937_64 same_generator(3);
  const RangeImage image = simulate(scene, rays, sensor, {1.0, true}, same_generator);
  const Pose& pose = image.sensor_pose;
  for (std::size_t i = 0; i < image.points.size(); ++i) {
    if (image.hits[i] < 0)
      continue;
    const Eigen::Vector3d q = pose.toLocal(image.points[i]);
    const Eigen::Vector3d before = pose.toLocal(noisy.points[i]);
    const double steps = fb / q.z() / sensor.disparity_quantum_px;
    // Rounding of about 500 steps, through a rotation and back.
    EXPECT_NEAR(steps, std::round(steps), 1e-10);
    EXPECT_LE(std::abs(fb / q.z() - fb / before.z()),
              0.5 * sensor.disparity_quantum_px + 1e-10);
    EXPECT_NEAR(q.cross(before).norm(), 0.0, 1e-14);
  }
}

TEST(Quantization, DisparityZeroIsNoPoint)
{
  const Sensor sensor = kinect();
  RangeImage image;
  // 43.5 px m / 1000 m rounds to zero steps of 1/8 px.
  image.points = {{0, 0, 1000.0}, {0, 0, 1.0}};
  quantizeDisparity(image, sensor);
  EXPECT_TRUE(image.points[0].array().isNaN().all());
  EXPECT_TRUE(image.points[1].allFinite());
}

TEST(Quantization, NeedsASensorThatQuantises)
{
  Sensor sensor = kinect();
  sensor.disparity_quantum_px = 0.0;
  std::mt19937_64 generator(1);
  EXPECT_THROW(
      simulate(makeScene("ball"), frustumRays(2, 0.1), sensor, {1.0, true}, generator),
      std::invalid_argument);
}

}} // namespace holdfast
