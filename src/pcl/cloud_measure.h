/// \file How large a cloud is and how dense: what a unit, a radius or a threshold can
/// be compared with.
#pragma once

#include <Eigen/Core>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstddef>
#include <limits>
#include <string>

namespace holdfast {

struct CloudMeasure {
  std::size_t points = 0;
  std::size_t valid = 0; ///< points with finite coordinates
  /// The box of the valid points, in the cloud's unit; zero where there are none.
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  /// Median distance to the nearest point elsewhere (copies at one place count as one);
  /// NaN where no two places are known.
  double spacing_m = std::numeric_limits<double>::quiet_NaN();
  /// Median distance of the valid points from the sensor's position; NaN without any.
  double range_m = std::numeric_limits<double>::quiet_NaN();
  bool organized = false; ///< an image: more than one row

  /// The longest side of the box.
  double extent() const
  {
    return (high - low).maxCoeff();
  }
};

/// From a sample of the points, always the same one: neighbours in the image of an
/// organized cloud, else the nearest of all points. Takes one pass over the points and
/// some 5 million distances at most, or 16 per point where these are more.
/// \param sensor_position for range_m, in the frame of the cloud.
CloudMeasure measureCloud(
    const pcl::PointCloud<pcl::PointXYZ>& cloud,
    const Eigen::Vector3d& sensor_position = Eigen::Vector3d::Zero());

/// "148652 of 307200 points are valid, over 3.1 x 2.4 x 2.8 m, 0.0035 m apart".
std::string describe(const CloudMeasure& measure);

/// Three significant digits, for messages: "0.0035", "3.1", "1520".
std::string shortNumber(double value);

} // namespace holdfast
