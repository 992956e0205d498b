/// \file What our features ask of their input before they touch it.
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/types.h>

#include <algorithm>
#include <string>

namespace holdfast::detail {

/// Empty when the cloud holds points, width * height of them, and the indices lie
/// within it; else what is wrong.
template <typename PointT>
std::string
inputError(const pcl::PointCloud<PointT>& cloud, const pcl::Indices& indices = {})
{
  if (cloud.empty())
    return "a cloud is empty";
  if (static_cast<std::size_t>(cloud.width) * cloud.height != cloud.size())
    return "width times height of a cloud is not its number of points";
  const auto size = static_cast<pcl::index_t>(cloud.size());
  const auto outside = std::find_if(indices.begin(), indices.end(), [size](auto i) {
    return i < 0 || i >= size;
  });
  if (outside == indices.end())
    return {};
  return "index " + std::to_string(*outside) + " is outside the cloud of " +
         std::to_string(size) + " points";
}

} // namespace holdfast::detail
