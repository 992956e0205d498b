#include "pcl/zero_points.h"

#include <algorithm>
#include <limits>

namespace holdfast {

int
invalidateZeroPoints(pcl::PointCloud<pcl::PointXYZ>& points, const Pose& sensor_pose)
{
  const auto is_zero = [](const pcl::PointXYZ& p) {
    return p.x == 0.0F && p.y == 0.0F && p.z == 0.0F;
  };
  const auto n = static_cast<int>(std::count_if(points.begin(), points.end(), is_zero));
  const bool at_sensor = sensor_pose.c.isZero(0.0);
  if (n == 0 || (n == 1 && !at_sensor))
    return 0;
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  std::replace_if(points.begin(),
                  points.end(),
                  is_zero,
                  pcl::PointXYZ(kNaN, kNaN, kNaN));
  points.is_dense = false;
  return n;
}

int
invalidateMovedZeros(pcl::PointCloud<pcl::PointXYZ>& points, const Pose& sensor_pose)
{
  if (sensor_pose.c.isZero(0.0))
    return 0; // they were not moved
  const Eigen::Vector3f c = sensor_pose.c.cast<float>();
  constexpr float kNearest = 1e-3F; // m: nothing is seen there
  const float rounding = std::min(4.0F * std::numeric_limits<float>::epsilon() *
                                      c.lpNorm<Eigen::Infinity>(),
                                  kNearest);
  int n = 0;
  for (pcl::PointXYZ& p : points)
    if ((p.getVector3fMap() - c).lpNorm<Eigen::Infinity>() <= rounding) {
      p.getVector3fMap().setConstant(std::numeric_limits<float>::quiet_NaN());
      ++n;
    }
  points.is_dense = points.is_dense && n == 0;
  return n;
}

} // namespace holdfast
