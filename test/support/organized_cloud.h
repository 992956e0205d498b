/// \file Organized clouds made from a depth for each pixel.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/camera.h>
#include <holdfast/sensor/sensor.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <cmath>
#include <limits>
#include <memory>

namespace holdfast::test {

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

inline Camera
makeCamera(int width, int height, double focal_px)
{
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = focal_px;
  camera.fy = focal_px;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

inline Sensor
makeSensor(const Camera& camera)
{
  Sensor sensor;
  sensor.name = "test";
  sensor.camera = camera;
  sensor.noise =
      std::make_shared<const StereoNoiseModel>(StereoNoiseModel::Parameters{});
  return sensor;
}

/// Point of pixel (u, v) at depthAt(u, v), taken from `pose`; NaN where the depth is.
template <typename DepthAt>
RangeCloud
makeOrganizedCloud(const Camera& camera, DepthAt&& depthAt, const Pose& pose = {})
{
  const auto width = static_cast<std::uint32_t>(camera.width);
  const auto height = static_cast<std::uint32_t>(camera.height);
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(width, height);
  points->is_dense = false;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const double depth = depthAt(u, v);
      const Eigen::Vector3d q = pose.toWorld(camera.backProject(u, v, depth));
      (*points)(u, v).getVector3fMap() =
          std::isnan(depth) ? Eigen::Vector3f::Constant(kNaN) : q.cast<float>().eval();
    }
  return {points, {}, pose};
}

} // namespace holdfast::test
