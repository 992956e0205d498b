#pragma once

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/io.h>

#include <memory>
#include <type_traits>

namespace holdfast {

namespace detail {

/// The points without the zeros that stand for no return; the same object where there
/// are none. \param count of the zeros.
pcl::PointCloud<pcl::PointXYZ>::ConstPtr withoutZeroPoints(
    const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& points,
    const Pose& sensor_pose,
    int& count);

/// "12 points at the sensor are taken as invalid", after what the notice says already.
void noteZeroPoints(int count, std::string* notice);

} // namespace detail

template <typename PointT>
RangeCloud
toRangeCloud(const typename pcl::PointCloud<PointT>::ConstPtr& cloud,
             std::string* notice)
{
  RangeCloud range;
  if constexpr (std::is_same_v<PointT, pcl::PointXYZ>)
    range.points = cloud;
  else {
    auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    pcl::copyPointCloud(*cloud, *points);
    range.points = points;
  }
  if constexpr (std::is_same_v<PointT, PointXYZCovariance>) {
    auto covariances = std::make_shared<Covariances>();
    covariances->reserve(cloud->size());
    for (const PointXYZCovariance& point : *cloud)
      covariances->push_back(point.getCovarianceMatrix());
    range.covariances = covariances;
  }
  range.sensor_pose = sensorPose(cloud->sensor_origin_, cloud->sensor_orientation_);
  int zeros = 0;
  range.points = detail::withoutZeroPoints(range.points, range.sensor_pose, zeros);
  if (validityError(range).empty())
    range.sensor_pose = chooseSensorPose(range.points, range.sensor_pose, notice);
  // PCL's default is the identity, so that nobody can have said it.
  range.sensor_pose_given = !isIdentity(range.sensor_pose);
  detail::noteZeroPoints(zeros, notice);
  return range;
}

} // namespace holdfast
