/// \file Drivers that write 0 0 0 where the sensor saw nothing.
#pragma once

#include <holdfast/geometry/pose.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace holdfast {

/// Makes points that lie exactly at 0 0 0 invalid (NaN) when the sensor stands there,
/// or when there are several of them: no surface goes through one point twice. \return
/// how many there were.
int invalidateZeroPoints(pcl::PointCloud<pcl::PointXYZ>& points,
                         const Pose& sensor_pose);

/// Likewise points at the sensor, to the rounding of floats, which were 0 0 0 before
/// the cloud was moved: no sensor sees itself. \return how many there were.
int invalidateMovedZeros(pcl::PointCloud<pcl::PointXYZ>& points,
                         const Pose& sensor_pose);

} // namespace holdfast
