#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/simulation/simulator.h>

#include "sensor/require.h"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace holdfast {

namespace {

Eigen::Vector3d
nanVector()
{
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

/// The field over the pixels of the camera in which the image's rays lie.
PatternField
fieldOver(const RangeImage& image, const Sensor& sensor)
{
  constexpr double kTolerance_px = 1e-6;
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<double> columns, rows;
  for (std::size_t i = 0; i < image.directions.size(); ++i) {
    const Eigen::Vector2d pixel =
        sensor.camera.project(image.sensor_pose.R.transpose() * image.directions[i]);
    const std::size_t u = i % width, v = i / width;
    if (v == 0)
      columns.push_back(pixel.x());
    if (u == 0)
      rows.push_back(pixel.y());
    if (!(std::abs(pixel.x() - columns[u]) < kTolerance_px) ||
        !(std::abs(pixel.y() - rows[v]) < kTolerance_px))
      throw std::invalid_argument("the rays do not lie on rows and columns of sensor " +
                                  sensor.name + ", whose noise has a pattern");
  }
  return {CorrelatedNoise(sensor.pattern), columns, rows};
}

/// Takes the pattern out of a point's own noise, as far as it is in it.
void
sharePattern(const Eigen::Vector3d& direction,
             double variance,
             Eigen::Matrix3d& covariance,
             Eigen::Matrix3d& root)
{
  constexpr double kRounding = 1e-9;
  const Eigen::Matrix3d shared = variance * direction * direction.transpose();
  const Eigen::Matrix3d rest = covariance - shared;
  root = squareRoot(rest);
  const Eigen::Matrix3d drawn = root * root.transpose();
  if ((drawn - rest).norm() > kRounding * covariance.norm())
    covariance = drawn + shared;
}

} // namespace

RayGrid
frustumRays(int n, double fov_rad)
{
  if (n < 1)
    throw std::invalid_argument("frustumRays: n must be positive");
  if (!(fov_rad > 0.0 && fov_rad < kPi))
    throw std::invalid_argument("frustumRays: fov_rad must lie between 0 and pi");
  const double half = std::tan(0.5 * fov_rad);
  const auto middle = [&](int i) { return half * ((2.0 * i + 1.0) / n - 1.0); };
  RayGrid rays{n, n, {}};
  for (int v = 0; v < n; ++v)
    for (int u = 0; u < n; ++u)
      rays.directions.emplace_back(middle(u), middle(v), 1.0);
  return rays;
}

RayGrid
pixelRays(const Camera& camera, int stride)
{
  if (stride < 1)
    throw std::invalid_argument("pixelRays: stride must be positive");
  RayGrid rays{(camera.width + stride - 1) / stride,
               (camera.height + stride - 1) / stride,
               {}};
  for (int v = 0; v < camera.height; v += stride)
    for (int u = 0; u < camera.width; u += stride)
      rays.directions.push_back(camera.backProject(u, v, 1.0));
  return rays;
}

Pose
lookAt(const Eigen::Vector3d& position,
       const Eigen::Vector3d& target,
       const Eigen::Vector3d& up)
{
  const Eigen::Vector3d z = (target - position).normalized();
  const Eigen::Vector3d down = -(up - up.dot(z) * z);
  if (!(target != position) || !(down.norm() > 1e-9 * up.norm()))
    throw std::invalid_argument("lookAt: no line of sight, or one along up");
  Pose pose;
  pose.R.col(2) = z;
  pose.R.col(1) = down.normalized();
  pose.R.col(0) = pose.R.col(1).cross(z);
  pose.c = position;
  return pose;
}

RangeImage
castRays(const Scene& scene,
         const RayGrid& rays,
         double min_range_m,
         double max_range_m)
{
  RangeImage image;
  image.width = rays.width;
  image.height = rays.height;
  image.sensor_pose = scene.sensor_pose;
  for (const Eigen::Vector3d& ray : rays.directions) {
    image.directions.push_back(scene.sensor_pose.R * ray);
    const auto hit = firstHit(scene, scene.sensor_pose.c, image.directions.back());
    // Rays have z = 1, so t is the depth.
    const bool seen = hit && hit->t >= min_range_m && hit->t <= max_range_m;
    image.hits.push_back(seen ? hit->index : -1);
    image.truth.push_back(
        seen ? scene.sensor_pose.c + hit->t * image.directions.back() : nanVector());
  }
  image.points = image.truth;
  image.covariances.assign(image.truth.size(), Eigen::Matrix3d::Zero());
  image.roots = image.covariances;
  return image;
}

void
attachNoise(RangeImage& image, const NoiseModel& noise, double noise_scale)
{
  requireNotNegative("noise_scale", noise_scale);
  image.pattern.reset();
  image.pattern_directions.clear();
  const Pose& pose = image.sensor_pose;
  for (std::size_t i = 0; i < image.truth.size(); ++i) {
    if (image.hits[i] < 0)
      continue;
    const Eigen::Matrix3d camera_frame = noise.covariance(pose.toLocal(image.truth[i]));
    image.covariances[i] =
        noise_scale * noise_scale * rotateCovariance(pose.R, camera_frame);
    image.roots[i] = squareRoot(image.covariances[i]);
  }
}

void
attachNoise(RangeImage& image, const Sensor& sensor, double noise_scale)
{
  attachNoise(image, *sensor.noise, noise_scale);
  if (sensor.pattern.empty())
    return;
  image.pattern = std::make_shared<const PatternField>(fieldOver(image, sensor));
  image.pattern_directions.assign(image.truth.size(), nanVector());
  const Pose& pose = image.sensor_pose;
  const double variance = sensor.pattern.variance();
  for (std::size_t i = 0; i < image.truth.size(); ++i) {
    if (image.hits[i] < 0)
      continue;
    Eigen::Vector3d& direction = image.pattern_directions[i];
    direction = noise_scale * pose.R *
                sensor.noise->patternDirection(pose.toLocal(image.truth[i]));
    sharePattern(direction, variance, image.covariances[i], image.roots[i]);
  }
}

void
drawNoise(const std::vector<Eigen::Vector3d>& truth,
          const std::vector<Eigen::Matrix3d>& roots,
          std::mt19937_64& generator,
          std::vector<Eigen::Vector3d>& out)
{
  if (roots.size() != truth.size())
    throw std::invalid_argument("drawNoise: not one root per point");
  std::normal_distribution<double> normal;
  out.resize(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    out[i] = truth[i];
    if (std::isnan(truth[i].x()))
      continue;
    Eigen::Vector3d n;
    for (double& component : n)
      component = normal(generator);
    out[i] += roots[i] * n;
  }
}

void
drawNoise(const RangeImage& image,
          std::mt19937_64& generator,
          std::vector<Eigen::Vector3d>& out)
{
  drawNoise(image.truth, image.roots, generator, out);
  if (!image.pattern)
    return;
  std::vector<double> field;
  image.pattern->draw(generator, field);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] += field[i] * image.pattern_directions[i];
}

void
quantizeDisparity(RangeImage& image, const Sensor& sensor)
{
  const double quantum = sensor.disparity_quantum_px;
  if (!(quantum > 0.0))
    throw std::invalid_argument("sensor " + sensor.name +
                                " does not quantise its disparity");
  const double fb = sensor.disparity_focal_px * sensor.baseline_m;
  const Pose& pose = image.sensor_pose;
  for (Eigen::Vector3d& point : image.points) {
    if (std::isnan(point.x()))
      continue;
    const Eigen::Vector3d q = pose.toLocal(point);
    const double disparity = std::round(fb / q.z() / quantum) * quantum;
    if (disparity > 0.0)
      point = pose.toWorld(q * (fb / disparity / q.z()));
    else
      point = nanVector();
  }
}

RangeImage
simulate(const Scene& scene,
         const RayGrid& rays,
         const Sensor& sensor,
         const SimulationOptions& options,
         std::mt19937_64& generator)
{
  RangeImage image = castRays(scene, rays, sensor.min_range_m, sensor.max_range_m);
  attachNoise(image, sensor, options.noise_scale);
  drawNoise(image, generator, image.points);
  if (options.quantize)
    quantizeDisparity(image, sensor);
  return image;
}

} // namespace holdfast
