/// \file The promises of loadCloud(), for the targets of each format.
#pragma once

#include "fuzz.h"
#include <holdfast/io/cloud_io.h>

namespace holdfast::fuzz {

/// A camera of the aspect ratio of the depth images among the seeds.
inline LoadOptions
loadOptions()
{
  LoadOptions options;
  options.camera.width = 640;
  options.camera.height = 480;
  options.camera.fx = options.camera.fy = 525.0;
  options.camera.cx = 319.5;
  options.camera.cy = 239.5;
  return options;
}

/// Either an error in one line, or a cloud that agrees with itself and has a point.
inline int
loadAnything(const std::uint8_t* data, std::size_t size)
{
  static const MemoryFile file;
  static const LoadOptions options = loadOptions();
  try {
    const RangeCloud cloud = loadCloud(file.hold(data, size), options);
    const auto& points = *cloud.points;
    require(std::size_t{points.width} * points.height == points.size(),
            "width * height is the number of points");
    require(!cloud.hasCovariances() || cloud.covariances->size() == points.size(),
            "there are as many covariances as points, or none");
    const int valid = countValidPoints(cloud);
    require(valid > 0, "a cloud has a valid point");
    require(!points.is_dense || static_cast<std::size_t>(valid) == points.size(),
            "a dense cloud has valid points alone");
    require(countInvalidCovariances(cloud) <= valid,
            "covariances are counted at valid points");
    require(cloud.sensor_pose.c.allFinite() && cloud.sensor_pose.R.allFinite(),
            "the sensor pose is finite");
  }
  catch (const std::runtime_error& error) {
    requireOneLine(error);
  }
  return 0;
}

} // namespace holdfast::fuzz
