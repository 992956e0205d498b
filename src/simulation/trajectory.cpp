#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/simulation/trajectory.h>

#include "sensor/require.h"

#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

using Eigen::Vector3d;

void
requireFrames(int frames)
{
  if (frames < 1)
    throw std::invalid_argument("a trajectory needs a frame");
}

Eigen::Matrix3d
aboutZ(double angle)
{
  return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix();
}

/// World z of the highest surface above (x, y); 0 where there is none.
double
heightAt(const Scene& scene, double x, double y)
{
  constexpr double kAboveAll = 20.0;
  const auto hit = firstHit(scene, {x, y, kAboveAll}, -Vector3d::UnitZ());
  return hit ? kAboveAll - hit->t : 0.0;
}

/// Averaged along the way with weights that fall to zero at 0.4 m, so that it does not
/// jump at a stone or step.
double
smoothHeightAt(const Scene& scene, double x, double y)
{
  constexpr int kSamples = 8; // to either side
  constexpr double kReach = 0.4;
  double sum = 0.0, weights = 0.0;
  for (int i = -kSamples + 1; i < kSamples; ++i) {
    const double weight = 1.0 - std::abs(i) / static_cast<double>(kSamples);
    sum += weight * heightAt(scene, x + kReach * i / kSamples, y);
    weights += weight;
  }
  return sum / weights;
}

/// What the gait does to a camera after s metres: metres and radians.
struct Gait {
  explicit Gait(double s)
  {
    constexpr double kStepLength = 0.4;
    const double step = 2.0 * kPi * s / kStepLength;
    const double stride = 0.5 * step;
    up = 0.015 * std::cos(step);
    left = 0.02 * std::sin(stride);
    yaw = 0.035 * std::sin(stride + 0.5);
    roll = 0.015 * std::sin(stride);
    pitch = 0.01 * std::sin(step);
  }

  double up, left, yaw, roll, pitch;
};

} // namespace

std::vector<Pose>
walk(const Scene& scene, int frames, const WalkOptions& options)
{
  requireFrames(frames);
  requireNotNegative("step_m", options.step_m);
  requirePositive("height_m", options.height_m);
  if (!(std::abs(options.down_rad) < 0.5 * kPi))
    throw std::invalid_argument("down_rad must lie in (-pi/2, pi/2)");
  std::vector<Pose> poses;
  for (int k = 0; k < frames; ++k) {
    const double s = k * options.step_m;
    const Gait gait(s);
    const double x = scene.walk_start.x() + s;
    const double y = scene.walk_start.y();
    const Vector3d position(x,
                            y + gait.left,
                            smoothHeightAt(scene, x, y) + options.height_m + gait.up);
    const double down = options.down_rad + gait.pitch;
    const Vector3d forward(std::cos(down), 0.0, -std::sin(down));
    Pose pose = lookAt(position, position + forward, Vector3d::UnitZ());
    pose.R = aboutZ(gait.yaw) * pose.R * aboutZ(gait.roll);
    poses.push_back(pose);
  }
  return poses;
}

std::vector<Pose>
circle(const Scene& scene, int frames, double step_m)
{
  requireFrames(frames);
  requireNotNegative("step_m", step_m);
  const Pose& start = scene.sensor_pose;
  const Vector3d arm = start.c - scene.middle;
  const double radius = arm.head<2>().norm();
  constexpr double kRounding = 1e-9;
  if (!(radius > kRounding * arm.norm()))
    throw std::invalid_argument("circle: the camera stands above the middle");
  if (!(arm.cross(start.R.col(2)).norm() <= 1e3 * kRounding * arm.norm()))
    throw std::invalid_argument("circle: the camera looks past the middle");
  std::vector<Pose> poses;
  for (int k = 0; k < frames; ++k) {
    const Eigen::Matrix3d turn = aboutZ(k * step_m / radius);
    // Exactly the start at k = 0.
    poses.push_back({turn * start.R, start.c + (turn * arm - arm)});
  }
  return poses;
}

Odometry
noisyOdometry(const std::vector<Pose>& poses,
              double sigma_rad,
              double sigma_m,
              std::mt19937_64& generator)
{
  if (poses.empty())
    throw std::invalid_argument("noisyOdometry: no pose");
  requireNotNegative("sigma_rad", sigma_rad);
  requireNotNegative("sigma_m", sigma_m);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    Vector3d error;
    for (double& component : error)
      component = sigma * normal(generator);
    return error;
  };
  Odometry odometry;
  odometry.poses.push_back(poses.front());
  for (std::size_t k = 1; k < poses.size(); ++k) {
    Pose increment = poses[k - 1].inverse() * poses[k];
    increment.R *= expMap(draw(sigma_rad));
    increment.c += draw(sigma_m);
    odometry.increments.push_back(increment);
    odometry.poses.push_back(odometry.poses.back() * increment);
  }
  return odometry;
}

RangeImage
inSensorFrame(RangeImage image)
{
  const Pose pose = std::exchange(image.sensor_pose, Pose{});
  const Eigen::Matrix3d turn = pose.R.transpose();
  for (auto* points : {&image.truth, &image.points})
    for (Vector3d& point : *points)
      point = pose.toLocal(point);
  for (auto* directions : {&image.directions, &image.pattern_directions})
    for (Vector3d& direction : *directions)
      direction = turn * direction;
  for (Eigen::Matrix3d& covariance : image.covariances)
    covariance = propagate(turn, covariance);
  for (Eigen::Matrix3d& root : image.roots)
    root = turn * root;
  return image;
}

FrameSimulator::FrameSimulator(Scene scene,
                               RayGrid rays,
                               Sensor sensor,
                               SimulationOptions options,
                               PatternOverTime pattern,
                               std::uint64_t seed)
: scene_(std::move(scene))
, rays_(std::move(rays))
, sensor_(std::move(sensor))
, options_(options)
, seed_(seed)
{
  // A look at nothing: what the pixels share does not depend on what they see.
  RangeImage image = castRays(Scene{}, rays_);
  attachNoise(image, sensor_, options_.noise_scale);
  if (options_.quantize)
    quantizeDisparity(image, sensor_);
  if (!image.pattern || pattern == PatternOverTime::Fresh)
    return;
  std::mt19937_64 generator = generatorOf(0);
  image.pattern->draw(generator, field_);
}

RangeImage
FrameSimulator::frame(int k, const Pose& sensor_pose) const
{
  return withNoise(k, truth(sensor_pose));
}

RangeImage
FrameSimulator::truth(const Pose& sensor_pose) const
{
  Scene seen = scene_; // shares its shapes
  seen.sensor_pose = sensor_pose;
  return castRays(seen, rays_, sensor_.min_range_m, sensor_.max_range_m);
}

RangeImage
FrameSimulator::withNoise(int k, RangeImage image) const
{
  if (k < 0)
    throw std::invalid_argument("FrameSimulator: frames are counted from 0");
  std::mt19937_64 generator = generatorOf(static_cast<std::uint32_t>(k) + 1);
  attachNoise(image, sensor_, options_.noise_scale);
  if (field_.empty())
    drawNoise(image, generator, image.points);
  else
    drawOnFixedPattern(generator, image);
  if (options_.quantize)
    quantizeDisparity(image, sensor_);
  return image;
}

std::mt19937_64
FrameSimulator::generatorOf(std::uint32_t stream) const
{
  std::seed_seq words{static_cast<std::uint32_t>(seed_),
                      static_cast<std::uint32_t>(seed_ >> 32U),
                      stream};
  return std::mt19937_64(words);
}

void
FrameSimulator::drawOnFixedPattern(std::mt19937_64& generator, RangeImage& image) const
{
  drawNoise(image.truth, image.roots, generator, image.points);
  for (std::size_t i = 0; i < image.points.size(); ++i)
    image.points[i] += field_[i] * image.pattern_directions[i];
}

} // namespace holdfast
