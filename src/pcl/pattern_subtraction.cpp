#include <holdfast/pcl/pattern_subtraction.h>

#include <holdfast/sensor/stereo_noise_model.h>

#include <pcl/common/point_tests.h>

#include <fmt/core.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>

namespace holdfast {
namespace {

// With fewer of the points in view, the camera is another.
constexpr double kLeastInView = 0.5;

double
focalTimesBaseline(const Sensor& sensor)
{
  const auto* stereo = dynamic_cast<const StereoNoiseModel*>(sensor.noise.get());
  if (stereo == nullptr)
    throw std::runtime_error(fmt::format("the sensor {} has a pattern map, but no "
                                         "disparities: its noise model is not stereo",
                                         sensor.name));
  return stereo->parameters().focal_px * stereo->parameters().baseline_m;
}

/// Of the map, row by row; nothing outside.
std::optional<std::size_t>
pixelOf(const Eigen::Vector3d& q, const Sensor& sensor)
{
  if (!(q.z() > 0.0))
    return std::nullopt;
  const Eigen::Vector2d at = sensor.camera.project(q);
  const double u = std::round(at.x()), v = std::round(at.y());
  const PatternMap& map = *sensor.pattern_map;
  if (!(u >= 0.0 && v >= 0.0 && u < map.width() && v < map.height()))
    return std::nullopt;
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(map.width()) +
         static_cast<std::size_t>(u);
}

} // namespace

RangeCloud
subtractPatternMap(const RangeCloud& cloud, const Sensor& sensor, std::string* notice)
{
  if (!sensor.pattern_map)
    return cloud;
  const double fb = focalTimesBaseline(sensor);
  const auto leave = [&](const std::string& why) {
    if (notice != nullptr)
      *notice = why + ": the sensor's pattern map is not subtracted";
    return cloud;
  };
  if (cloud.hasCovariances())
    return leave("the cloud has covariances of its own");
  const bool organized = cloud.points->height > 1;
  const std::string error = patternMapError(sensor,
                                            static_cast<int>(cloud.points->width),
                                            static_cast<int>(cloud.points->height));
  if (organized && !error.empty())
    throw std::runtime_error(error);
  const Pose to_camera = cloud.sensor_pose.inverse();
  const pcl::PointCloud<pcl::PointXYZ>::Ptr points(
      new pcl::PointCloud<pcl::PointXYZ>(*cloud.points));
  std::size_t valid = 0, seen = 0;
  for (std::size_t i = 0; i < points->size(); ++i) {
    pcl::PointXYZ& point = (*points)[i];
    if (!pcl::isFinite(point))
      continue;
    ++valid;
    const Eigen::Vector3d q = to_camera.toWorld(point.getVector3fMap().cast<double>());
    const std::optional<std::size_t> pixel = organized ? i : pixelOf(q, sensor);
    if (!pixel)
      continue;
    ++seen;
    const double px = sensor.pattern_map->error(*pixel);
    if (px != 0.0) // else not a bit of it changes
      point.getVector3fMap() =
          cloud.sensor_pose.toWorld(withoutDisparityError(q, px, fb)).cast<float>();
  }
  if (static_cast<double>(seen) < kLeastInView * static_cast<double>(valid))
    return leave("most points are in no pixel of the sensor's camera");
  RangeCloud result = cloud;
  result.points = points;
  return result;
}

std::string
patternMapError(const Sensor& sensor, int width, int height)
{
  if (!sensor.pattern_map ||
      (sensor.pattern_map->width() == width && sensor.pattern_map->height() == height))
    return "";
  return fmt::format("{} x {} pixels, where the pattern map of the sensor {} has {} x "
                     "{}: take its own images, or --no-pattern",
                     width,
                     height,
                     sensor.name,
                     sensor.pattern_map->width(),
                     sensor.pattern_map->height());
}

} // namespace holdfast
