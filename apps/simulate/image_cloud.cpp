#include "image_cloud.h"

#include <holdfast/pcl/pattern_subtraction.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace holdfast::app {

namespace {

RangeCloud
toCloud(const RangeImage& image, bool with_covariances)
{
  pcl::PointCloud<pcl::PointXYZ> points(static_cast<std::uint32_t>(image.width),
                                        static_cast<std::uint32_t>(image.height));
  points.is_dense = false;
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].getVector3fMap() = image.points[i].cast<float>();
  RangeCloud cloud;
  cloud.points = std::make_shared<const pcl::PointCloud<pcl::PointXYZ>>(points);
  cloud.sensor_pose = image.sensor_pose;
  if (with_covariances) {
    auto covariances = std::make_shared<Covariances>();
    for (const Eigen::Matrix3d& Sigma : image.covariances)
      covariances->push_back(Sigma.cast<float>());
    cloud.covariances = covariances;
  }
  return cloud;
}

/// The camera adds what subtractPatternMap() takes away: a cloud with covariances of
/// its own stays as it is. After any rounding, so that what is left is in whole steps.
RangeCloud
withPatternMap(const RangeCloud& cloud, const Sensor& sensor, double noise_scale)
{
  if (!sensor.pattern_map)
    return cloud;
  std::vector<float> errors = sensor.pattern_map->errors();
  for (float& error : errors)
    error *= -static_cast<float>(noise_scale);
  Sensor opposite = sensor;
  opposite.pattern_map = std::make_shared<const PatternMap>(sensor.camera.width,
                                                            sensor.camera.height,
                                                            errors);
  return subtractPatternMap(cloud, opposite);
}

} // namespace

bool
seesAnything(const RangeImage& image)
{
  return std::any_of(image.points.begin(), image.points.end(), [](const auto& point) {
    return point.allFinite();
  });
}

RangeCloud
cloudOf(const RangeImage& image,
        const Sensor& sensor,
        double noise_scale,
        bool with_covariances)
{
  return withPatternMap(toCloud(image, with_covariances), sensor, noise_scale);
}

} // namespace holdfast::app
