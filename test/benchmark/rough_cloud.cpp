#include "rough_cloud.h"

#include <holdfast/sensor/stereo_noise_model.h>

#include <cmath>
#include <memory>
#include <random>

namespace holdfast::benchmarks {

namespace {

constexpr double kDepth = 0.8; // m
constexpr double kWavelength = 0.1; // m
constexpr double kAmplitude = 0.005; // m: curvature amplitude (2 pi / wavelength)^2

StereoNoiseModel::Parameters
noiseParameters()
{
  StereoNoiseModel::Parameters parameters;
  parameters.sigma_point_px *= 0.1;
  parameters.sigma_disparity_px *= 0.1;
  return parameters;
}

double
depthAt(const Camera& camera, int u, int v)
{
  const double wave = 2.0 * 3.14159265358979 / kWavelength;
  const double x = kDepth * (u - camera.cx) / camera.fx;
  const double y = kDepth * (v - camera.cy) / camera.fy;
  return kDepth + 0.2 * y + kAmplitude * std::sin(wave * x) * std::cos(wave * y);
}

/// Calls use(seed, indices) for every seed.
template <typename Use>
void
forEachNeighborhood(const Scene& scene, const SamplerOptions& options, Use&& use)
{
  const NeighborhoodSampler sampler(scene.cloud, scene.sensor, options);
  const auto scratch = sampler.makeScratch();
  std::vector<int> indices;
  for (const int seed : sampler.seeds()) {
    sampler.neighborhood(seed, *scratch, indices);
    use(seed, indices);
  }
}

Eigen::Vector3d
position(const Scene& scene, int index)
{
  return (*scene.cloud.points)[index].getVector3fMap().cast<double>();
}

} // namespace

Scene
makeScene()
{
  const StereoNoiseModel::Parameters noise = noiseParameters();
  Scene scene;
  scene.sensor.name = "benchmark";
  scene.sensor.noise = std::make_shared<const StereoNoiseModel>(noise);
  const Camera& camera = scene.sensor.camera;

  std::mt19937_64 generator(20160601);
  std::normal_distribution<double> normal;
  auto points =
      pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(camera.width, camera.height);
  const double disparity_depth = noise.focal_px * noise.baseline_m;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const double disparity = disparity_depth / depthAt(camera, u, v) +
                               noise.sigma_disparity_px * normal(generator);
      const double pixel_u = u + noise.sigma_point_px * normal(generator);
      const double pixel_v = v + noise.sigma_point_px * normal(generator);
      (*points)(u, v).getVector3fMap() =
          camera.backProject(pixel_u, pixel_v, disparity_depth / disparity)
              .cast<float>();
    }
  scene.cloud.points = points;
  return scene;
}

SamplerOptions
makeSamplerOptions(Neighborhood neighborhood, double radius_m)
{
  SamplerOptions options;
  options.neighborhood = neighborhood;
  options.radius_m = radius_m;
  options.spacing_m = 0.0075;
  return options;
}

double
meanSize(const Scene& scene, const SamplerOptions& options)
{
  double sum = 0.0;
  int count = 0;
  forEachNeighborhood(scene, options, [&](int, const std::vector<int>& indices) {
    sum += static_cast<double>(indices.size());
    ++count;
  });
  return sum / count;
}

double
radiusFor(const Scene& scene, Neighborhood neighborhood, int points)
{
  // The size grows with the square of the radius, in steps of pixels.
  double radius = 0.01;
  for (int i = 0; i < 6; ++i)
    radius *=
        std::sqrt(points / meanSize(scene, makeSamplerOptions(neighborhood, radius)));
  return radius;
}

std::vector<PointBatch>
gatherBatches(const Scene& scene, const SamplerOptions& options)
{
  std::vector<PointBatch> batches;
  forEachNeighborhood(scene, options, [&](int seed, const std::vector<int>& indices) {
    batches.emplace_back();
    batches.back().clear(position(scene, seed));
    for (const int i : indices) {
      const Eigen::Vector3d q = position(scene, i);
      batches.back().add(q, scene.sensor.noise->covariance(q));
    }
  });
  return batches;
}

} // namespace holdfast::benchmarks
