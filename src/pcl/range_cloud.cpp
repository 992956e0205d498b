#include <holdfast/pcl/range_cloud.h>

#include <fmt/core.h>

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
    return fmt::format("the cloud has {} covariances for {} points",
                       cloud.covariances->size(),
                       n);
  if (!cloud.sensor_pose.c.allFinite())
    return "the sensor's viewpoint must be finite";
  return {};
}

} // namespace holdfast
