/// \file Pinhole depth camera.
///
/// Camera frame: x right, y down, z along the optical axis, metres; pixel (u, v) counts
/// columns to the right and rows down, both from 0 at the centre of the first pixel.
#pragma once

#include <Eigen/Core>

namespace holdfast {

struct Camera {
  int width = 640;
  int height = 480;
  double fx = 575.8; ///< px
  double fy = 575.8; ///< px
  double cx = 319.5; ///< px
  double cy = 239.5; ///< px

  /// Point at `depth` (z, not range) metres seen in pixel (u, v).
  Eigen::Vector3d backProject(double u, double v, double depth) const
  {
    return {(u - cx) / fx * depth, (v - cy) / fy * depth, depth};
  }

  /// Pixel in which a point with z > 0 is seen.
  Eigen::Vector2d project(const Eigen::Vector3d& q) const
  {
    return {fx * q.x() / q.z() + cx, fy * q.y() / q.z() + cy};
  }
};

} // namespace holdfast
