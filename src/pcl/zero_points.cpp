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

} // namespace holdfast
