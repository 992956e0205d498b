/// \file From images to clouds.
#pragma once

#include "openni2_source.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <optional>

namespace holdfast::io {

/// Lets a depth image wait for its colour, but not longer than for the next depth
/// image.
class FramePairer {
public:
  FramePairer() = default;
  explicit FramePairer(const SourceInfo& source)
  : has_color_(source.has_color), half_period_us_(500000U / source.frames_per_second)
  {}

  /// Takes an image of either camera. \return the depth image that is ready now, if
  /// any.
  Image push(const Image& image);

  /// The depth image that still waits, if any.
  Image flush();

  /// The newest colour image, if any.
  const Image& color() const
  {
    return color_;
  }

private:
  bool isReady() const;

  bool has_color_ = false;
  std::uint64_t half_period_us_ = 0;
  Image depth_;
  Image color_;
};

/// The camera that was given, or else one of these fields of view, rad, whose axis
/// passes through the middle of the image. \throw pcl::IOException when the one given
/// is of another size, or a field of view makes no sense.
Camera chooseCamera(const std::optional<Camera>& given,
                    int width,
                    int height,
                    double horizontal_fov,
                    double vertical_fov);

/// Organized cloud in the camera frame, m; NaN where the depth is 0. Its header has the
/// image's time stamp and index. \throw pcl::IOException when the image is not of the
/// camera's size.
pcl::PointCloud<pcl::PointXYZ>::Ptr depthToCloud(const Image& depth,
                                                 const Camera& camera);

/// The points with the colours of an image, pixel by pixel; null when that is not of
/// the same size.
pcl::PointCloud<pcl::PointXYZRGBA>::Ptr colorCloud(
    const pcl::PointCloud<pcl::PointXYZ>& points,
    const Image& color);

} // namespace holdfast::io
