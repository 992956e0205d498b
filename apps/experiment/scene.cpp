#include "scene.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/scene.h>

#include <cmath>
#include <memory>

namespace holdfast::app {

std::string
typeName(PatchType type)
{
  const std::string surface(surfaceName(type.surface));
  return type.surface == SurfaceType::Plane ?
             surface + "_" + std::string(boundaryName(type.boundary)) :
             surface;
}

NoiseModel::ConstPtr
kinectNoise()
{
  return std::make_shared<StereoNoiseModel>(StereoNoiseModel::Parameters{});
}

Scene
randomView(const std::string& name, std::mt19937_64& generator, double spread_m)
{
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(generator);
  };
  const double distance = uniform(1.0, 1.2);
  const double azimuth = uniform(0.0, 2.0 * kPi), elevation = uniform(0.52, 1.1);
  Scene scene = makeScene(name, distance);
  Eigen::Vector3d middle = scene.sensor_pose.toWorld({0.0, 0.0, distance});
  if (spread_m > 0.0) {
    middle.x() += uniform(-spread_m, spread_m);
    middle.y() += uniform(-spread_m, spread_m);
  }
  const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth),
                                  std::sin(elevation));
  scene.sensor_pose =
      lookAt(middle + distance * direction, middle, Eigen::Vector3d::UnitZ());
  return scene;
}

PointBatch
noiseFreeBatch(const Scene& scene, const RayGrid& rays, const NoiseModel& noise)
{
  RangeImage image = castRays(scene, rays);
  attachNoise(image, noise);
  PointBatch batch;
  batch.clear(scene.patches.front().c, scene.sensor_pose.c);
  for (std::size_t i = 0; i < image.truth.size(); ++i)
    if (image.hits[i] == 0)
      batch.add(image.truth[i], image.covariances[i]);
  return batch;
}

namespace {

RangeCloud
cloudWith(const std::vector<Eigen::Vector3d>& positions, const RangeImage& image)
{
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>(
      static_cast<std::uint32_t>(image.width),
      static_cast<std::uint32_t>(image.height));
  points->is_dense = false;
  for (std::size_t i = 0; i < points->size(); ++i)
    (*points)[i].getVector3fMap() = positions[i].cast<float>();
  RangeCloud cloud;
  cloud.points = points;
  cloud.sensor_pose = image.sensor_pose;
  return cloud;
}

} // namespace

RangeCloud
cloudOf(const RangeImage& image)
{
  return cloudWith(image.points, image);
}

RangeCloud
trueCloudOf(const RangeImage& image)
{
  return cloudWith(image.truth, image);
}

void
takeTruth(const RangeImage& image, const std::vector<int>& indices, PointBatch& batch)
{
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Eigen::Vector3d q =
        image.truth[static_cast<std::size_t>(indices[i])] - batch.origin();
    batch.channel(PointBatch::X)[i] = q.x();
    batch.channel(PointBatch::Y)[i] = q.y();
    batch.channel(PointBatch::Z)[i] = q.z();
  }
}

void
addMeanAndVariance(Json& row, const std::string& key, const MeanAndVariance& value)
{
  row[key + "_mean"] = value.mean;
  row[key + "_variance"] = value.variance;
}

} // namespace holdfast::app
