#include "openni2_frames.h"

#include "openni2_runtime.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <utility>

namespace holdfast::io {

namespace {

struct Rgb {
  std::uint8_t r, g, b;
};

/// Row `v` of an image whose pixels are of type Pixel, from left to right.
template <typename Pixel>
class Row {
public:
  Row(const Image& image, int v)
  : first_(reinterpret_cast<const Pixel*>(image.pixels.get() +
                                          static_cast<std::size_t>(v) * image.stride))
  , last_(image.width - 1)
  , is_mirrored_(image.is_mirrored)
  {}

  const Pixel& operator[](int u) const
  {
    return first_[is_mirrored_ ? last_ - u : u];
  }

private:
  const Pixel* first_;
  int last_;
  bool is_mirrored_;
};

} // namespace

bool
FramePairer::isReady() const
{
  if (!depth_.pixels || !has_color_)
    return depth_.pixels != nullptr;
  return color_.pixels && color_.timestamp_us + half_period_us_ >= depth_.timestamp_us;
}

Image
FramePairer::push(const Image& image)
{
  Image overdue;
  if (image.is_depth)
    overdue = std::exchange(depth_, image);
  else
    color_ = image;
  return isReady() ? flush() : overdue;
}

Image
FramePairer::flush()
{
  return std::exchange(depth_, {});
}

Camera
chooseCamera(const std::optional<Camera>& given,
             int width,
             int height,
             double horizontal_fov,
             double vertical_fov)
{
  if (given && (given->width != width || given->height != height))
    throw Openni2Error(
        fmt::format("the given camera is not one of {} x {} pixels", width, height));
  if (given)
    return *given;
  const auto is_plausible = [](double fov) { return fov > 0.01 && fov < M_PI - 0.01; };
  if (!is_plausible(horizontal_fov) || !is_plausible(vertical_fov))
    throw Openni2Error("the device does not know its field of view: set the camera");
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = width / 2.0 / std::tan(horizontal_fov / 2.0);
  camera.fy = height / 2.0 / std::tan(vertical_fov / 2.0);
  camera.cx = (width - 1) / 2.0; // between the two middle pixels
  camera.cy = (height - 1) / 2.0;
  return camera;
}

pcl::PointCloud<pcl::PointXYZ>::Ptr
depthToCloud(const Image& depth, const Camera& camera)
{
  if (depth.width != camera.width || depth.height != camera.height)
    throw Openni2Error("a depth image is not of the size it should be");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(
      static_cast<std::uint32_t>(camera.width),
      static_cast<std::uint32_t>(camera.height));
  cloud->is_dense = false;
  cloud->header.stamp = depth.timestamp_us;
  cloud->header.seq = static_cast<std::uint32_t>(depth.index);
  std::size_t i = 0;
  for (int v = 0; v < camera.height; ++v) {
    const Row<std::uint16_t> row(depth, v);
    for (int u = 0; u < camera.width; ++u, ++i) {
      const Eigen::Vector3f q =
          camera.backProject(u, v, row[u] * depth.metres_per_unit).cast<float>();
      (*cloud)[i] = row[u] != 0 ? pcl::PointXYZ(q.x(), q.y(), q.z()) :
                                  pcl::PointXYZ(nan, nan, nan);
    }
  }
  return cloud;
}

pcl::PointCloud<pcl::PointXYZRGBA>::Ptr
colorCloud(const pcl::PointCloud<pcl::PointXYZ>& points, const Image& color)
{
  const int width = static_cast<int>(points.width);
  const int height = static_cast<int>(points.height);
  if (color.width != width || color.height != height)
    return nullptr;
  auto cloud =
      pcl::make_shared<pcl::PointCloud<pcl::PointXYZRGBA>>(points.width, points.height);
  cloud->header = points.header;
  cloud->is_dense = points.is_dense;
  std::size_t i = 0;
  for (int v = 0; v < height; ++v) {
    const Row<Rgb> row(color, v);
    for (int u = 0; u < width; ++u, ++i) {
      pcl::PointXYZRGBA& q = (*cloud)[i];
      q.getVector3fMap() = points[i].getVector3fMap();
      q.r = row[u].r;
      q.g = row[u].g;
      q.b = row[u].b;
      q.a = 255;
    }
  }
  return cloud;
}

} // namespace holdfast::io
