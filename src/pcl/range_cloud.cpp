#include <holdfast/pcl/range_cloud.h>

namespace holdfast {

std::string
validityError(const RangeCloud& cloud)
{
  if (!cloud.points)
    return "the cloud has no points object";
  const std::size_t n = cloud.points->size();
  if (static_cast<std::size_t>(cloud.points->width) * cloud.points->height != n)
    return "width times height of the cloud is not its number of points";
  if (cloud.hasCovariances() && cloud.covariances->size() != n)
    return "the cloud has " + std::to_string(cloud.covariances->size()) +
           " covariances for " + std::to_string(n) + " points";
  if (!cloud.sensor_pose.c.allFinite())
    return "the sensor's viewpoint must be finite";
  return {};
}

} // namespace holdfast
