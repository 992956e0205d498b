#include "cloud_measure.h"

#include <pcl/common/point_tests.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace holdfast {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr std::size_t kMostSamples = 1000;
// Where each costs a pass over all points: medians of so few are good to a quarter.
constexpr std::size_t kMostSearches = 100, kFewestSearches = 16;
constexpr std::size_t kMostDistances = 5'000'000;
constexpr float kNoDistance = std::numeric_limits<float>::infinity();

double
median(std::vector<double>& values)
{
  if (values.empty())
    return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Evenly through the valid points, `count` of them at most.
std::vector<int>
sampleOf(const std::vector<int>& valid, std::size_t count)
{
  std::vector<int> sample;
  const std::size_t size = std::min(count, valid.size());
  for (std::size_t i = 0; i < size; ++i)
    sample.push_back(valid[i * valid.size() / size]);
  return sample;
}

// Infinite for a copy or a point that is not valid.
float
squaredDistance(const pcl::PointXYZ& a, const pcl::PointXYZ& b)
{
  const float squared = (a.getVector3fMap() - b.getVector3fMap()).squaredNorm();
  return squared > 0.0F ? squared : kNoDistance;
}

float
nearestInImage(const Cloud& cloud, int index)
{
  const int width = static_cast<int>(cloud.width);
  const int u = index % width, v = index / width;
  float nearest = kNoDistance;
  for (const auto& [du, dv] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const bool inside = u + du >= 0 && u + du < width && v + dv >= 0 &&
                        v + dv < static_cast<int>(cloud.height);
    if (inside)
      nearest = std::min(nearest, squaredDistance(cloud[index], cloud(u + du, v + dv)));
  }
  return nearest;
}

float
nearestOfAll(const Cloud& cloud, int index)
{
  float nearest = kNoDistance;
  for (const pcl::PointXYZ& other : cloud)
    nearest = std::min(nearest, squaredDistance(cloud[index], other));
  return nearest;
}

double
spacingOf(const Cloud& cloud, const std::vector<int>& valid, bool organized)
{
  const std::size_t affordable =
      organized ? kMostSamples :
                  std::clamp(kMostDistances / std::max<std::size_t>(cloud.size(), 1),
                             kFewestSearches,
                             kMostSearches);
  std::vector<double> distances;
  for (const int index : sampleOf(valid, affordable)) {
    const float squared =
        organized ? nearestInImage(cloud, index) : nearestOfAll(cloud, index);
    if (squared < kNoDistance)
      distances.push_back(std::sqrt(squared));
  }
  return median(distances);
}

} // namespace

CloudMeasure
measureCloud(const Cloud& cloud, const Eigen::Vector3d& sensor_position)
{
  CloudMeasure measure;
  measure.points = cloud.size();
  std::vector<int> valid;
  valid.reserve(cloud.size());
  for (int i = 0; i < static_cast<int>(cloud.size()); ++i)
    if (pcl::isFinite(cloud[i]))
      valid.push_back(i);
  measure.valid = valid.size();
  // Not a crooked one, whose width times height is not its size.
  measure.organized =
      cloud.height > 1 &&
      static_cast<std::size_t>(cloud.width) * cloud.height == cloud.size();
  if (valid.empty())
    return measure;
  Eigen::Vector3f low = cloud[valid.front()].getVector3fMap(), high = low;
  for (const int i : valid) {
    low = low.cwiseMin(cloud[i].getVector3fMap());
    high = high.cwiseMax(cloud[i].getVector3fMap());
  }
  measure.low = low.cast<double>();
  measure.high = high.cast<double>();
  measure.spacing_m = spacingOf(cloud, valid, measure.organized);
  std::vector<double> ranges;
  for (const int i : sampleOf(valid, kMostSamples))
    ranges.push_back(
        (cloud[i].getVector3fMap().cast<double>() - sensor_position).norm());
  measure.range_m = median(ranges);
  return measure;
}

std::string
shortNumber(double value)
{
  // Three digits would be 1.52e+03.
  const bool long_digits = std::abs(value) >= 1e3 && std::abs(value) < 1e7;
  return long_digits ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

std::string
describe(const CloudMeasure& measure)
{
  std::string text =
      fmt::format("{} of {} points are valid", measure.valid, measure.points);
  if (measure.valid == 0)
    return text;
  const Eigen::Vector3d size = measure.high - measure.low;
  text += fmt::format(", over {} x {} x {} m",
                      shortNumber(size.x()),
                      shortNumber(size.y()),
                      shortNumber(size.z()));
  if (std::isfinite(measure.spacing_m))
    text += fmt::format(", {} m apart", shortNumber(measure.spacing_m));
  return text;
}

} // namespace holdfast
