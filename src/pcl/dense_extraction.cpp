#include <holdfast/pcl/dense_extraction.h>

#include <holdfast/pcl/conversions.h>

#include "sampling_budget.h"

#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace holdfast {
namespace {

/// How many of `pixels` there are at stride / 2, and every stride from there on.
int
placesAlong(int pixels, int stride)
{
  const int beyond_first = pixels - 1 - stride / 2;
  return beyond_first < 0 ? 0 : beyond_first / stride + 1;
}

std::vector<int>
pixelsOf(const DenseExtraction& dense, int image_width)
{
  std::vector<int> pixels;
  pixels.reserve(static_cast<std::size_t>(dense.width) *
                 static_cast<std::size_t>(dense.height));
  const int first = dense.stride / 2;
  for (int row = 0; row < dense.height; ++row)
    for (int column = 0; column < dense.width; ++column)
      pixels.push_back((row * dense.stride + first) * image_width +
                       column * dense.stride + first);
  return pixels;
}

} // namespace

std::string
validityError(const RangeCloud& cloud, const ExtractionOptions& options, int stride)
{
  if (std::string error = validityError(cloud); !error.empty())
    return error;
  const auto width = static_cast<int>(cloud.points->width);
  const auto height = static_cast<int>(cloud.points->height);
  if (height < 2)
    return "the cloud is not organized: it has no pixels to put patches at";
  if (stride < 1)
    return "the stride must be a pixel at least";
  if (placesAlong(width, stride) == 0 || placesAlong(height, stride) == 0)
    return "a stride of " + std::to_string(stride) + " leaves no pixel of " +
           std::to_string(width) + " x " + std::to_string(height);
  if (isLimited(options.sampler) || options.max_overlap < 1.0)
    return "an image of patches has no limits of their number, area, time or overlap";
  return {};
}

DenseExtraction
extractDense(const RangeCloud& cloud,
             const Sensor& sensor,
             const ExtractionOptions& options,
             int stride,
             DenseExtraction former)
{
  if (const std::string error = validityError(cloud, options, stride); !error.empty())
    throw std::invalid_argument(error);
  const auto width = static_cast<int>(cloud.points->width);
  const auto height = static_cast<int>(cloud.points->height);
  DenseExtraction dense{stride,
                        placesAlong(width, stride),
                        placesAlong(height, stride),
                        {}};
  ExtractionOptions all = options;
  all.keep_failures = true;
  PatchSites sites;
  sites.seeds = seedsAt(cloud, pixelsOf(dense, width));
  dense.result = extractPatches(cloud, sensor, all, sites, std::move(former.result));
  return dense;
}

pcl::PointCloud<PatchPoint>
toPatchCloud(const DenseExtraction& dense, const Pose& sensor_pose)
{
  pcl::PointCloud<PatchPoint> cloud = toPatchCloud(dense.result.patches, sensor_pose);
  cloud.width = static_cast<std::uint32_t>(dense.width);
  cloud.height = static_cast<std::uint32_t>(dense.height);
  return cloud;
}

} // namespace holdfast
