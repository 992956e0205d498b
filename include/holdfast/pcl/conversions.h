/// \file Between PCL's clouds and points and what the fit works on.
#pragma once

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/pcl/point_types.h>
#include <holdfast/sensor/noise_calibration.h>

#include <pcl/point_cloud.h>

#include <string>
#include <vector>

namespace holdfast {

/// Where PCL says that a cloud was taken from, q_cloud = R q_camera + c; no rotation if
/// the quaternion is zero.
Pose sensorPose(const Eigen::Vector4f& sensor_origin,
                const Eigen::Quaternionf& sensor_orientation);

/// Writes a pose where PCL keeps it.
template <typename PointT>
void
writeSensorPose(const Pose& pose, pcl::PointCloud<PointT>& cloud)
{
  cloud.sensor_origin_.setZero();
  cloud.sensor_origin_.template head<3>() = pose.c.cast<float>();
  cloud.sensor_orientation_ = Eigen::Quaterniond(pose.R).cast<float>();
}

/// A cloud of any type with x, y and z as the fit wants it. PointXYZ is not copied;
/// PointXYZCovariance brings its covariances along.
///
/// The sensor pose is the cloud's, unless its points contradict it (chooseSensorPose):
/// pcl::transformPointCloud, for one, moves the points and not the sensor.
/// \param notice if not null: receives one line when the pose was contradicted.
template <typename PointT>
RangeCloud toRangeCloud(const typename pcl::PointCloud<PointT>::ConstPtr& cloud,
                        std::string* notice = nullptr);

/// The points in the camera frame, as the calibration of noise wants them.
PointImage toPointImage(const RangeCloud& cloud);

/// The points with their covariances inside, NaN if the cloud has none.
pcl::PointCloud<PointXYZCovariance> toPointCloud(const RangeCloud& cloud);

/// A patch as a point; NaN where it is not accepted.
PatchPoint toPatchPoint(const ExtractedPatch& patch);

/// The patch of a point. What a point does not keep is empty: iterations, the mean
/// shift, the position of the seed, details of the validation. Numbers carry the
/// rounding to single precision.
/// \throw std::invalid_argument when surface and boundary make no patch type or status
/// or verdict are unknown, as in a point that did not come from toPatchPoint().
ExtractedPatch toExtractedPatch(const PatchPoint& point);

/// The patches as a cloud in the frame they are in, seen from `sensor_pose`.
pcl::PointCloud<PatchPoint> toPatchCloud(const std::vector<ExtractedPatch>& patches,
                                         const Pose& sensor_pose);

} // namespace holdfast

#include <holdfast/pcl/impl/conversions.hpp>
