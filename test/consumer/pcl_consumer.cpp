// Uses holdfast::pcl: patches of a small organized cloud seen by a simulated camera, by
// the engine and by the PCL class. The cloud grows and shrinks through PCL's own
// allocator, here and inside the libraries.
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/patch_estimation.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>

namespace {

holdfast::Sensor
smallSensor()
{
  holdfast::Sensor sensor;
  sensor.name = "small";
  sensor.camera = {80, 60, 72.0, 72.0, 39.5, 29.5};
  sensor.noise = std::make_shared<holdfast::StereoNoiseModel>(
      holdfast::StereoNoiseModel::Parameters());
  return sensor;
}

/// A wall one metre away with a ball of 0.2 m radius before its middle.
pcl::PointCloud<pcl::PointXYZ>::Ptr
seenBy(const holdfast::Camera& camera)
{
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = camera.backProject(u, v, 1.0);
      const Eigen::Vector3d centre(0.0, 0.0, 1.0);
      const double b = ray.dot(centre) / ray.squaredNorm();
      const double c = (centre.squaredNorm() - 0.2 * 0.2) / ray.squaredNorm();
      const double t = b * b > c ? b - std::sqrt(b * b - c) : 1.0;
      cloud->push_back(pcl::PointXYZ(static_cast<float>(t * ray.x()),
                                     static_cast<float>(t * ray.y()),
                                     static_cast<float>(t)));
    }
  cloud->width = static_cast<std::uint32_t>(camera.width);
  cloud->height = static_cast<std::uint32_t>(camera.height);
  return cloud;
}

/// How many patches the class finds, from seeds of its own.
std::size_t
estimatedPatches(const pcl::PointCloud<pcl::PointXYZ>::Ptr& cloud,
                 const holdfast::Sensor& sensor)
{
  holdfast::PatchEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(sensor);
  estimation.setRadiusSearch(0.1);
  estimation.setSeedsFromSampler(true);
  pcl::PointCloud<holdfast::PatchPoint> patches;
  estimation.compute(patches);
  std::size_t found = 0;
  for (const holdfast::PatchPoint& patch : patches)
    found += std::isfinite(patch.x);
  return found;
}

} // namespace

int
main()
{
  const char* const path = "pcl_consumer.pcd";
  const holdfast::Sensor sensor = smallSensor();
  holdfast::RangeCloud cloud;
  const auto points = seenBy(sensor.camera);
  cloud.points = points;
  holdfast::saveCloud(path, cloud);
  holdfast::RangeCloud loaded = holdfast::loadCloud(path);

  holdfast::ExtractionOptions options;
  options.sampler.radius_m = 0.1;
  options.sampler.spacing_m = 0.1;
  const auto discs = holdfast::extractPatches(loaded, sensor, options);
  options.sampler.neighborhood = holdfast::Neighborhood::Knn; // through PCL's k-d tree
  const auto nearest = holdfast::extractPatches(cloud, sensor, options);

  const std::size_t estimated = estimatedPatches(points, sensor);

  std::printf("%zu patches from discs, %zu from nearest points, %zu by the class\n",
              discs.patches.size(),
              nearest.patches.size(),
              estimated);
  return discs.patches.empty() || nearest.patches.empty() || estimated == 0;
}
