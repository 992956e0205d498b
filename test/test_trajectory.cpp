#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/trajectory.h>

#include "support/random.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

namespace holdfast { namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Whose disparity errors are all shared by neighbours, or none, at the usual sigma.
Sensor
kinect(bool with_pattern)
{
  const StereoNoiseModel::Parameters parameters;
  Sensor sensor;
  sensor.name = "kinect";
  sensor.noise = std::make_shared<StereoNoiseModel>(parameters);
  sensor.min_range_m = 0.4;
  sensor.max_range_m = 8.0;
  if (with_pattern)
    sensor.pattern.waves = {
        {parameters.sigma_disparity_px, 20.0, PatternShape::Exponential}};
  return sensor;
}

bool
areEqual(const Pose& a, const Pose& b)
{
  return a.R == b.R && a.c == b.c;
}

/// The errors of disparity in px, NaN where there is no point: the other errors of the
/// model leave the depth as it is.
std::vector<double>
disparityErrors(const RangeImage& world)
{
  const RangeImage image = inSensorFrame(world);
  std::vector<double> errors;
  for (std::size_t i = 0; i < image.points.size(); ++i)
    errors.push_back((image.points[i] - image.truth[i]).z() /
                     image.pattern_directions[i].z());
  return errors;
}

/// Of the pixels that are seen in both.
double
largestDifference(const std::vector<double>& a, const std::vector<double>& b)
{
  double largest = 0.0;
  int both = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(a[i]) || std::isnan(b[i]))
      continue;
    largest = std::max(largest, std::abs(a[i] - b[i]));
    ++both;
  }
  EXPECT_GT(both, 1000);
  return largest;
}

class Frames : public testing::Test {
protected:
  FrameSimulator simulator(bool with_pattern,
                           PatternOverTime pattern = PatternOverTime::Fixed,
                           std::uint64_t seed = 1) const
  {
    const Sensor sensor = kinect(with_pattern);
    return {scene_, pixelRays(sensor.camera, 8), sensor, {}, pattern, seed};
  }

  Scene scene_ = makeScene("rocks");
  std::vector<Pose> poses_ = circle(scene_, 4, 0.3);
};

TEST_F(Frames, FixedPatternStaysWithThePixels)
{
  const FrameSimulator camera = simulator(true);
  const std::vector<double> first = disparityErrors(camera.frame(0, poses_[0]));
  const std::vector<double> other = disparityErrors(camera.frame(3, poses_[3]));
  // There is no white part; its root is zero to the rounding of an eigenvalue, 1e-8 of
  // sigma.
  EXPECT_LT(largestDifference(first, other), 1e-6);
  const FrameSimulator another = simulator(true, PatternOverTime::Fixed, 2);
  EXPECT_GT(largestDifference(first, disparityErrors(another.frame(0, poses_[0]))),
            0.1);
}

TEST_F(Frames, FreshPatternDoesNot)
{
  const FrameSimulator camera = simulator(true, PatternOverTime::Fresh);
  EXPECT_GT(largestDifference(disparityErrors(camera.frame(0, poses_[0])),
                              disparityErrors(camera.frame(3, poses_[3]))),
            0.1);
}

TEST_F(Frames, FixedPatternHasTheStatedVariance)
{
  // Over cameras: within one, neighbours are not independent.
  double sum = 0.0;
  int n = 0;
  constexpr int kCameras = 100;
  for (std::uint64_t seed = 1; seed <= kCameras; ++seed) {
    const Sensor sensor = kinect(true);
    const RayGrid rays = pixelRays(sensor.camera, 64);
    const FrameSimulator camera(scene_, rays, sensor, {}, PatternOverTime::Fixed, seed);
    for (const double error : disparityErrors(camera.frame(0, poses_[0])))
      if (!std::isnan(error)) {
        sum += error * error;
        ++n;
      }
  }
  // 64 px are three lengths apart, correlations of 0.04 add 1 % to the spread: five
  // standard deviations of a chi-square.
  const double variance = kinect(true).pattern.variance();
  EXPECT_NEAR(sum / n / variance, 1.0, 5.0 * 1.05 * std::sqrt(2.0 / n));
}

TEST_F(Frames, WhiteNoiseIsDrawnAnewAndDoesNotDependOnOtherFrames)
{
  const FrameSimulator camera = simulator(false);
  const RangeImage first = camera.frame(0, poses_[0]);
  const RangeImage second = camera.frame(1, poses_[0]);
  const RangeImage again = simulator(false).frame(1, poses_[0]);
  const RangeImage other =
      simulator(false, PatternOverTime::Fixed, 2).frame(1, poses_[0]);
  int seen = 0;
  for (std::size_t i = 0; i < first.points.size(); ++i) {
    if (first.hits[i] < 0)
      continue;
    ++seen;
    EXPECT_EQ(first.truth[i], second.truth[i]);
    EXPECT_NE(first.points[i], second.points[i]);
    EXPECT_EQ(again.points[i], second.points[i]);
    EXPECT_NE(other.points[i], second.points[i]);
  }
  EXPECT_GT(seen, 1000);
}

TEST_F(Frames, AreTheSameInTheFrameOfTheSensor)
{
  const FrameSimulator camera = simulator(true);
  const RangeImage world = camera.frame(2, poses_[2]);
  const RangeImage image = inSensorFrame(world);
  EXPECT_TRUE(isIdentity(image.sensor_pose));
  const RayGrid rays = pixelRays(kinect(true).camera, 8);
  for (std::size_t i = 0; i < image.points.size(); ++i) {
    // Rounding of metres, through a rotation.
    EXPECT_LT((image.directions[i] - rays.directions[i]).norm(), 1e-14);
    if (world.hits[i] < 0) {
      EXPECT_TRUE(image.points[i].hasNaN());
      continue;
    }
    EXPECT_LT((poses_[2].toWorld(image.points[i]) - world.points[i]).norm(), 1e-14);
    EXPECT_LT((poses_[2].toWorld(image.truth[i]) - world.truth[i]).norm(), 1e-14);
    EXPECT_LT(image.truth[i].cross(image.directions[i]).norm(), 1e-14);
    EXPECT_LT(image.pattern_directions[i].cross(image.directions[i]).norm(), 1e-14);
    const Eigen::Matrix3d Sigma =
        kinect(false).noise->covariance(image.truth[i]); // of the whole noise
    EXPECT_LT((image.covariances[i] - Sigma).norm(), 1e-8 * Sigma.norm());
  }
}

TEST_F(Frames, MisuseIsRefused)
{
  EXPECT_THROW(simulator(false).frame(-1, poses_[0]), std::invalid_argument);
  Sensor sensor = kinect(false);
  const RayGrid rays = pixelRays(sensor.camera, 64);
  const auto fixed = PatternOverTime::Fixed;
  EXPECT_THROW(FrameSimulator(scene_, rays, sensor, {-1.0, false}, fixed, 1),
               std::invalid_argument);
  EXPECT_THROW(FrameSimulator(scene_, rays, sensor, {1.0, true}, fixed, 1),
               std::invalid_argument)
      << "no disparity quantum";
  RayGrid mixed = rays;
  std::swap(mixed.directions[0], mixed.directions[7]);
  EXPECT_THROW(FrameSimulator(scene_, mixed, kinect(true), {}, fixed, 1),
               std::invalid_argument)
      << "rays in no rows and columns";
}

TEST(Trajectories, DoNotDependOnTheNumberOfFrames)
{
  const Scene scene = makeScene("boulder_field");
  const std::vector<Pose> short_walk = walk(scene, 5), long_walk = walk(scene, 12);
  const std::vector<Pose> short_way = circle(scene, 5), long_way = circle(scene, 12);
  std::mt19937_64 generator(1), again(1);
  const Odometry one = noisyOdometry(short_walk, 0.01, 0.01, generator);
  const Odometry two = noisyOdometry(long_walk, 0.01, 0.01, again);
  ASSERT_EQ(one.poses.size(), 5u);
  ASSERT_EQ(two.increments.size(), 11u);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_TRUE(areEqual(short_walk[k], long_walk[k]));
    EXPECT_TRUE(areEqual(short_way[k], long_way[k]));
    EXPECT_TRUE(areEqual(one.poses[k], two.poses[k]));
  }
}

TEST(Trajectories, WalksSeeTheGroundAllTheWay)
{
  for (const char* name : {"boulder_field", "stairway"}) {
    SCOPED_TRACE(name);
    const Scene scene = makeScene(name);
    const RayGrid rays = pixelRays(Camera{}, 40);
    const std::vector<Pose> poses = walk(scene, 101);
    EXPECT_NEAR(poses.back().c.x() - poses.front().c.x(), 10.0, 1e-12);
    for (const Pose& pose : poses) {
      Scene seen = scene;
      seen.sensor_pose = pose;
      const RangeImage image = castRays(seen, rays, 0.4, 8.0);
      const auto hits = std::count_if(image.hits.begin(),
                                      image.hits.end(),
                                      [](int hit) { return hit >= 0; });
      EXPECT_EQ(hits, static_cast<long>(image.hits.size())) << pose.c.transpose();
    }
  }
}

TEST(Trajectories, WalksPassOneMetreTwentyAboveTheGround)
{
  Scene scene;
  scene.shapes = {std::make_shared<Box>(Pose{Eigen::Matrix3d::Identity(), {0, 0, 0.5}},
                                        Eigen::Vector3d(20, 20, 1))};
  WalkOptions options;
  options.step_m = 0.03;
  const std::vector<Pose> poses = walk(scene, 50, options);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose& pose = poses[k];
    EXPECT_NEAR(pose.c.x(),
                scene.walk_start.x() + 0.03 * static_cast<double>(k),
                1e-12);
    // What the gait adds, as documented.
    EXPECT_NEAR(pose.c.y(), 0.0, 0.0201);
    EXPECT_NEAR(pose.c.z(), 2.2, 0.0151);
    EXPECT_NEAR(std::asin(-pose.R(2, 2)), 0.25 * kPi, 0.011);
    EXPECT_LT((pose.R.transpose() * pose.R - Eigen::Matrix3d::Identity()).norm(),
              1e-14);
    EXPECT_GT(pose.R.determinant(), 0.0);
    EXPECT_LT(pose.R(2, 1), -0.69) << "upright"; // -cos of down
  }
  options.step_m = 0.0;
  for (const Pose& pose : walk(scene, 3, options))
    EXPECT_TRUE(areEqual(pose, walk(scene, 1, options).front()));
}

TEST(Trajectories, CirclesLookAtTheMiddle)
{
  for (const char* name : {"sphere", "table"}) {
    SCOPED_TRACE(name);
    const Scene scene = makeScene(name, 1.3);
    const std::vector<Pose> poses = circle(scene, 40, 0.2);
    EXPECT_TRUE(areEqual(poses.front(), scene.sensor_pose));
    const double radius = (poses[0].c - scene.middle).head<2>().norm();
    for (std::size_t k = 0; k < poses.size(); ++k) {
      // The middle is 1.3 m in front of the camera.
      EXPECT_LT((poses[k].toLocal(scene.middle) - Eigen::Vector3d(0, 0, 1.3)).norm(),
                1e-13);
      EXPECT_NEAR(poses[k].c.z(), poses[0].c.z(), 1e-14);
      // Chord of an arc of 0.2 m.
      if (k > 0) {
        EXPECT_NEAR((poses[k].c - poses[k - 1].c).norm(),
                    2.0 * radius * std::sin(0.1 / radius),
                    1e-13);
      }
    }
  }
}

TEST(Trajectories, OdometryHasTheStatedErrors)
{
  test::Random random;
  constexpr double kSigma_rad = 0.003, kSigma_m = 0.02;
  std::vector<Pose> poses;
  for (int k = 0; k < 3001; ++k)
    poses.push_back({random.rotation(), random.normalVector()});
  const Odometry odometry = noisyOdometry(poses, kSigma_rad, kSigma_m, random.engine());
  ASSERT_EQ(odometry.poses.size(), poses.size());
  EXPECT_TRUE(areEqual(odometry.poses.front(), poses.front()));
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    const Pose truth = poses[k].inverse() * poses[k + 1];
    const Pose& noisy = odometry.increments[k];
    Eigen::Matrix<double, 6, 1> error;
    error << logMap(truth.R.transpose() * noisy.R) / kSigma_rad,
        (noisy.c - truth.c) / kSigma_m;
    sum += error * error.transpose();
    EXPECT_TRUE(areEqual(odometry.poses[k] * noisy, odometry.poses[k + 1]));
  }
  // NEES: chi-square with 6 n degrees of freedom; entries of the mean outer product
  // have sqrt(2 / n) at most. Five standard deviations each.
  const double n = static_cast<double>(poses.size()) - 1.0;
  EXPECT_NEAR(sum.trace() / (6.0 * n), 1.0, 5.0 * std::sqrt(2.0 / (6.0 * n)));
  EXPECT_LT((sum / n - Eigen::Matrix<double, 6, 6>::Identity()).cwiseAbs().maxCoeff(),
            5.0 * std::sqrt(2.0 / n));
}

TEST(Trajectories, OdometryWithoutErrorsIsTheTruth)
{
  std::mt19937_64 generator(1);
  const std::vector<Pose> poses = walk(makeScene("stairway"), 20);
  const Odometry odometry = noisyOdometry(poses, 0.0, 0.0, generator);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    // Rounding, twenty times.
    EXPECT_LT((odometry.poses[k].c - poses[k].c).norm(), 1e-13);
    EXPECT_LT((odometry.poses[k].R - poses[k].R).norm(), 1e-13);
  }
}

TEST(Trajectories, MisuseIsRefused)
{
  const Scene scene = makeScene("rocks");
  std::mt19937_64 generator(1);
  EXPECT_THROW(walk(scene, 0), std::invalid_argument);
  EXPECT_THROW(walk(scene, 2, {-0.1, 1.2, 0.7}), std::invalid_argument);
  EXPECT_THROW(walk(scene, 2, {kNaN, 1.2, 0.7}), std::invalid_argument);
  EXPECT_THROW(walk(scene, 2, {0.1, 0.0, 0.7}), std::invalid_argument);
  EXPECT_THROW(walk(scene, 2, {0.1, 1.2, 1.6}), std::invalid_argument);
  EXPECT_THROW(circle(scene, 0), std::invalid_argument);
  EXPECT_THROW(circle(scene, 2, -0.1), std::invalid_argument);
  Scene above = scene;
  above.sensor_pose = lookAt({0, 0, 2}, scene.middle, {0, 1, 0});
  EXPECT_THROW(circle(above, 2), std::invalid_argument);
  Scene past = scene;
  past.sensor_pose.c.x() += 0.1;
  EXPECT_THROW(circle(past, 2), std::invalid_argument);
  EXPECT_THROW(noisyOdometry({}, 0.1, 0.1, generator), std::invalid_argument);
  EXPECT_THROW(noisyOdometry({Pose{}}, -0.1, 0.1, generator), std::invalid_argument);
  EXPECT_THROW(noisyOdometry({Pose{}}, 0.1, kNaN, generator), std::invalid_argument);
}

}} // namespace holdfast
