/// \file A cloud with everything the fit wants to know about it.
#pragma once

#include <holdfast/geometry/pose.h>
#include <holdfast/sensor/camera.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <memory>
#include <string>
#include <vector>

namespace holdfast {

/// One covariance per point of a cloud and in its frame, m^2.
using Covariances = std::vector<Eigen::Matrix3f>;
using CovariancesConstPtr = std::shared_ptr<const Covariances>;

struct RangeCloud {
  /// Points in the frame of the cloud, m; organized when height > 1. Invalid: NaN.
  pcl::PointCloud<pcl::PointXYZ>::ConstPtr points;
  /// One per point, shared by the copies of a cloud as the points are; null or empty:
  /// the sensor's noise model is used.
  CovariancesConstPtr covariances;
  /// Where the sensor stood: q_cloud = R q_camera + c, camera frame of sensor/camera.h.
  Pose sensor_pose;
  /// Where the origin of the points' frame lies in the file's frame, m: coordinates too
  /// large for float are shifted before they become float.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  /// The sensor pose was said by the file or by the caller; else it is an assumption,
  /// which is doubted where the points contradict it.
  bool sensor_pose_given = false;

  bool hasCovariances() const
  {
    return covariances && !covariances->empty();
  }

  /// The points have as many rows and columns as the camera.
  bool hasSizeOf(const Camera& camera) const
  {
    return static_cast<int>(points->width) == camera.width &&
           static_cast<int>(points->height) == camera.height;
  }
};

/// Empty when the cloud can be worked on, else one sentence: no points object, width *
/// height or the number of covariances differs from the number of points.
std::string validityError(const RangeCloud& cloud);

} // namespace holdfast
