/// \file Clouds from the bytes of messages, whichever ROS brings them.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace holdfast::robot {

/// Where the numbers of a sensor_msgs/PointCloud2 are. Coordinates are 32-bit floats.
struct PointLayout {
  std::size_t width = 0, height = 0;
  std::size_t point_step = 0, row_step = 0; ///< bytes
  std::size_t x = 0, y = 0, z = 0; ///< bytes from the beginning of a point
  bool is_bigendian = false;
};

/// The points of such a message; 0 0 0, which some drivers give for no return, is none.
/// \throw std::runtime_error when layout and size contradict each other.
RangeCloud readPoints(const PointLayout& layout,
                      const std::uint8_t* data,
                      std::size_t size);

/// Where the numbers of a depth image in a sensor_msgs/Image are.
struct DepthLayout {
  std::size_t width = 0, height = 0;
  std::size_t row_step = 0; ///< bytes
  std::string encoding; ///< "16UC1", "mono16": mm; "32FC1": m
  bool is_bigendian = false;
};

/// The points that the camera of a sensor sees, in its frame; those that are nearer or
/// further than the sensor can measure are none.
/// \throw std::runtime_error when layout, size and camera contradict each other.
RangeCloud readDepth(const DepthLayout& layout,
                     const std::uint8_t* data,
                     std::size_t size,
                     const Sensor& sensor);

} // namespace holdfast::robot
