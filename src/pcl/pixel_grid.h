/// \file An organized cloud as its camera sees it.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <optional>
#include <vector>

namespace holdfast {

/// Pixels of one image row, or rows of a window: [begin, end).
struct PixelRange {
  int begin = 0;
  int end = 0;
};

struct PixelWindow {
  PixelRange columns;
  PixelRange rows;
};

struct PixelGrid {
  Camera camera; ///< width and height are those of the cloud
  double margin_px = 0.0; ///< how far a point may lie from the pixel it was measured in
  std::vector<float> depth; ///< z in the camera frame, m, row by row; NaN: no point

  const float* row(int v) const
  {
    return depth.data() + static_cast<std::ptrdiff_t>(v) * camera.width;
  }

  /// The pixels in which points of a ball may have been measured.
  PixelWindow ballWindow(const Eigen::Vector3d& centre, double radius) const;
};

/// Nothing when the cloud is not organized or its points are not on the pixels of a
/// pinhole camera.
std::optional<PixelGrid> makePixelGrid(const RangeCloud& cloud, const Sensor& sensor);

} // namespace holdfast
