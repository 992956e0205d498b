#include "scene.h"

#include <holdfast/sensor/stereo_noise_model.h>

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
