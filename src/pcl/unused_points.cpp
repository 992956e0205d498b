#include "unused_points.h"

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

namespace holdfast {
namespace {

/// The bits of a coordinate; those of 0 for -0, which is the same place.
std::uint32_t
bitsOf(float x)
{
  const float value = x + 0.0F;
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

std::size_t
hashOf(const pcl::PointXYZ& p)
{
  std::uint64_t hash = bitsOf(p.x);
  for (const float x : {p.y, p.z})
    hash = (hash ^ (hash >> 29)) * 0x9E3779B97F4A7C15ULL + bitsOf(x);
  return static_cast<std::size_t>(hash ^ (hash >> 32));
}

} // namespace

bool
isSamePlace(const pcl::PointXYZ& a, const pcl::PointXYZ& b)
{
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

UnusedPoints::UnusedPoints(const RangeCloud& cloud) : cloud_(cloud)
{
  points_.in_cloud = static_cast<int>(cloud.points->size());
  points_.invalid = static_cast<int>(
      std::count_if(cloud.points->begin(),
                    cloud.points->end(),
                    [](const pcl::PointXYZ& point) { return !pcl::isFinite(point); }));
}

void
UnusedPoints::drop(std::size_t i, int PointAccounting::*reason)
{
  if (!pcl::isFinite((*cloud_.points)[i]) || (!out_.empty() && out_[i]))
    return;
  if (out_.empty())
    out_.resize(cloud_.points->size(), false);
  out_[i] = true;
  ++(points_.*reason);
}

void
UnusedPoints::dropDuplicates()
{
  const auto& points = *cloud_.points;
  std::size_t slots = 16;
  while (slots < 2 * points.size())
    slots *= 2;
  std::vector<int> first(slots, -1); // open addressing
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!pcl::isFinite(points[i]) || (!out_.empty() && out_[i]))
      continue;
    std::size_t slot = hashOf(points[i]) & (slots - 1);
    while (first[slot] >= 0 && !isSamePlace(points[first[slot]], points[i]))
      slot = (slot + 1) & (slots - 1);
    if (first[slot] >= 0)
      drop(i, &PointAccounting::duplicate);
    else
      first[slot] = static_cast<int>(i);
  }
}

PointAccounting
UnusedPoints::accounting() const
{
  PointAccounting points = points_;
  points.used = points.in_cloud - points.invalid - points.behind_camera -
                points.out_of_view - points.invalid_covariance - points.duplicate;
  return points;
}

RangeCloud
UnusedPoints::usedCloud() const
{
  RangeCloud used = cloud_;
  if (out_.empty())
    return used;
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud_.points);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < points->size(); ++i)
    if (out_[i])
      (*points)[i] = pcl::PointXYZ(kNaN, kNaN, kNaN);
  points->is_dense = false;
  used.points = points;
  return used;
}

} // namespace holdfast
