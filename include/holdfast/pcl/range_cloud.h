/// \file A cloud with everything the fit wants to know about it.
#pragma once

#include <holdfast/geometry/pose.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <string>
#include <vector>

namespace holdfast {

struct RangeCloud {
  /// Points in the frame of the cloud, m; organized when height > 1. Invalid: NaN.
  pcl::PointCloud<pcl::PointXYZ>::ConstPtr points;
  /// One covariance per point in the same frame, m^2, or empty: the sensor's noise
  /// model is used then.
  std::vector<Eigen::Matrix3f> covariances;
  /// Where the sensor stood: q_cloud = R q_camera + c, camera frame of sensor/camera.h.
  Pose sensor_pose;
};

/// Empty when the cloud can be worked on, else one sentence: no points object, width *
/// height or the number of covariances differs from the number of points.
std::string validityError(const RangeCloud& cloud);

} // namespace holdfast
