/// \file From where a picture shows the world.
#pragma once

#include "canvas.h"

#include <holdfast/geometry/pose.h>

#include <optional>
#include <vector>

namespace holdfast::app {

/// Camera frame: x right, y down, z away from the eye.
class View {
public:
  /// As a camera in this pose sees the world: lengths shrink with distance.
  static View perspective(const Pose& camera);

  /// From far away: parallel lines stay parallel, lengths are true.
  /// \param orientation camera to world.
  static View orthographic(const Eigen::Matrix3d& orientation);

  /// From azimuth (to the right of `front`) and elevation (towards `up`), rad, both
  /// unit vectors at right angles; orthographic.
  static View orbit(const Eigen::Vector3d& front,
                    const Eigen::Vector3d& up,
                    double azimuth,
                    double elevation);

  /// Moves the picture so that nearly all points fill the frame, then enlarges it about
  /// its middle. Stray points, the outer 1 % on each side, do not count.
  void fit(const std::vector<Eigen::Vector3d>& points, const Frame& frame, double zoom);

  /// Nothing for points behind the eye.
  std::optional<ScreenPoint> project(const Eigen::Vector3d& world) const;

  /// Unit vector.
  Eigen::Vector3d towardsEye(const Eigen::Vector3d& world) const;

  /// Distance from the eye's plane, m; negative for points behind an orthographic one.
  double depth(double nearness) const;

  /// The inverse.
  double nearness(double depth_m) const;

  /// Width of a pixel at that depth, m.
  double pixelSize(double depth_m) const;

  /// Unit normal, world frame, towards the eye, of the plane that passes through a
  /// point with these changes of nearness per px to the right and down.
  Eigen::Vector3d normal(const ScreenPoint& at, double per_x, double per_y) const;

  /// 0 to 1 for a surface with this unit normal, world frame, under a lamp above the
  /// left shoulder. Both sides of a surface are lit.
  double brightness(const Eigen::Vector3d& normal) const;

private:
  View(const Pose& camera, bool perspective)
  : camera_(camera), perspective_(perspective)
  {}

  Pose camera_;
  bool perspective_;
  double scale_ = 1.0; ///< px per unit of x/z, or per metre
  Eigen::Vector2d shift_ = Eigen::Vector2d::Zero(); ///< px
};

} // namespace holdfast::app
