/// \file Frames of depth cameras, whichever grabber they come from.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/camera.h>

#include <pcl/io/grabber.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

namespace holdfast {

/// One depth image as a cloud.
struct RangeFrame {
  using ConstPtr = std::shared_ptr<const RangeFrame>;

  /// Organized, camera frame (sensor/camera.h); the sensor pose is the identity.
  RangeCloud cloud;
  /// The same points with the newest colour; null without.
  pcl::PointCloud<pcl::PointXYZRGBA>::ConstPtr colored;
  Camera camera; ///< on whose pixels the points lie
  std::uint64_t timestamp_us = 0; ///< clock of the device; also in the cloud's header
  int index = 0; ///< counted by the device; also in the cloud's header
  std::chrono::steady_clock::time_point received; ///< when it reached this computer
};

/// Calls `use` for every frame of a grabber: one that delivers RangeFrames as
/// Openni2Grabber does or, as PCL's own do, clouds of PointXYZ, PointXYZRGBA,
/// PointXYZRGB or PointXYZI. The camera of such clouds is recovered from the points, or
/// the default where that fails.
/// \throw std::invalid_argument when the grabber delivers none of these.
boost::signals2::connection connectFrames(
    pcl::Grabber& grabber,
    const std::function<void(const RangeFrame::ConstPtr&)>& use);

} // namespace holdfast
