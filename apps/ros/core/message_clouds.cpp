#include "core/message_clouds.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace holdfast::robot {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

bool
isHostBigEndian()
{
  const std::uint16_t one = 1;
  std::uint8_t first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

template <typename Number>
Number
numberAt(const std::uint8_t* bytes, bool is_swapped)
{
  std::array<std::uint8_t, sizeof(Number)> own{};
  std::copy_n(bytes, own.size(), own.begin());
  if (is_swapped)
    std::reverse(own.begin(), own.end());
  Number number;
  std::memcpy(&number, own.data(), own.size());
  return number;
}

pcl::PointCloud<pcl::PointXYZ>::Ptr
emptyImage(std::size_t width, std::size_t height)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(
      static_cast<std::uint32_t>(width),
      static_cast<std::uint32_t>(height),
      pcl::PointXYZ(kNaN, kNaN, kNaN));
  points->is_dense = false;
  return points;
}

/// Rows of so many items of so many bytes lie within the data.
/// \throw std::runtime_error when they do not.
void
requireRows(std::size_t width,
            std::size_t height,
            std::size_t item,
            std::size_t row_step,
            std::size_t size)
{
  // Quotients, since products of what a message says may overflow.
  const bool row_fits = item > 0 && (width == 0 || row_step / item >= width);
  const bool rows_fit = height == 0 || row_step == 0 || size / row_step >= height;
  if (!row_fits || !rows_fit)
    throw std::runtime_error(
        fmt::format("{} x {} items of {} bytes in rows of {} bytes do not lie in {} "
                    "bytes",
                    width,
                    height,
                    item,
                    row_step,
                    size));
}

} // namespace

RangeCloud
readPoints(const PointLayout& layout, const std::uint8_t* data, std::size_t size)
{
  const std::size_t furthest = std::max({layout.x, layout.y, layout.z});
  if (furthest + sizeof(float) > layout.point_step)
    throw std::runtime_error("coordinates lie outside of the points");
  requireRows(layout.width, layout.height, layout.point_step, layout.row_step, size);
  const bool is_swapped = layout.is_bigendian != isHostBigEndian();
  const auto points = emptyImage(layout.width, layout.height);
  std::size_t i = 0;
  for (std::size_t v = 0; v < layout.height; ++v)
    for (std::size_t u = 0; u < layout.width; ++u, ++i) {
      const std::uint8_t* bytes = data + v * layout.row_step + u * layout.point_step;
      const Eigen::Vector3f p(numberAt<float>(bytes + layout.x, is_swapped),
                              numberAt<float>(bytes + layout.y, is_swapped),
                              numberAt<float>(bytes + layout.z, is_swapped));
      if (p.allFinite() && !p.isZero(0.0F))
        (*points)[i].getVector3fMap() = p;
    }
  RangeCloud cloud;
  cloud.points = points;
  return cloud;
}

RangeCloud
readDepth(const DepthLayout& layout,
          const std::uint8_t* data,
          std::size_t size,
          const Sensor& sensor)
{
  const Camera& camera = sensor.camera;
  const bool is_float = layout.encoding == "32FC1";
  if (!is_float && layout.encoding != "16UC1" && layout.encoding != "mono16")
    throw std::runtime_error("depth images are 16UC1 or 32FC1, not " + layout.encoding);
  if (layout.width != static_cast<std::size_t>(camera.width) ||
      layout.height != static_cast<std::size_t>(camera.height))
    throw std::runtime_error(
        fmt::format("a depth image of {} x {} pixels does not go with a camera of {} x "
                    "{}",
                    layout.width,
                    layout.height,
                    camera.width,
                    camera.height));
  const std::size_t item = is_float ? sizeof(float) : sizeof(std::uint16_t);
  requireRows(layout.width, layout.height, item, layout.row_step, size);
  const bool is_swapped = layout.is_bigendian != isHostBigEndian();
  const auto points = emptyImage(layout.width, layout.height);
  std::size_t i = 0;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u, ++i) {
      const std::uint8_t* bytes = data + static_cast<std::size_t>(v) * layout.row_step +
                                  static_cast<std::size_t>(u) * item;
      const double depth = is_float ? double{numberAt<float>(bytes, is_swapped)} :
                                      1e-3 * numberAt<std::uint16_t>(bytes, is_swapped);
      if (depth > 0.0 && depth >= sensor.min_range_m && depth <= sensor.max_range_m)
        (*points)[i].getVector3fMap() = camera.backProject(u, v, depth).cast<float>();
    }
  RangeCloud cloud;
  cloud.points = points;
  return cloud;
}

} // namespace holdfast::robot
