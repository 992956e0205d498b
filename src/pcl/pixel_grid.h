/// \file An organized cloud as its camera sees it.
#pragma once

#include "pixel_vectors.h"

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <optional>
#include <vector>

namespace holdfast {

/// Of pixelResidual(): worse than this and the pixels are not those of the camera.
inline constexpr double kMaxResidualPx = 2.0;

struct PixelGrid {
  Camera camera; ///< width and height are those of the cloud
  double margin_px = 0.0; ///< how far a point may lie from the pixel it was measured in
  /// z in the camera frame, m, row by row, and kRowPadding more; NaN: no point.
  std::vector<float> depth;

  PixelRows rows() const
  {
    return {depth.data(), camera.width};
  }

  const float* row(int v) const
  {
    return rows().row(v);
  }

  /// The pixels in which points of a ball may have been measured.
  PixelWindow ballWindow(const Eigen::Vector3d& centre, double radius) const;
};

/// Nothing when the cloud is not organized or its points are not on the pixels of a
/// pinhole camera.
std::optional<PixelGrid> makePixelGrid(const RangeCloud& cloud, const Sensor& sensor);

} // namespace holdfast
