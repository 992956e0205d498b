/// \file Which places of a patch have points of the cloud under them.
#pragma once

#include <holdfast/patch/patch.h>

#include <vector>

namespace holdfast::app {

/// The cells of one patch's bounding square in its local xy plane.
class SupportedCells {
public:
  /// Everywhere, for patches without a cloud.
  SupportedCells() = default;

  /// \param points in the frame of the patch, m.
  /// \param half_side of the square, m.
  SupportedCells(const std::vector<Eigen::Vector3d>& points, double half_side);

  bool contains(const Eigen::Vector2d& xy) const;

private:
  int cellOf(double coordinate) const;

  int side_ = 0; ///< cells; 0: everywhere
  double half_side_ = 0.0;
  std::vector<bool> is_supported_;
};

/// The points of a cloud, ordered so that those near a patch are found fast.
class PatchSupport {
public:
  /// \param points world frame, m.
  explicit PatchSupport(std::vector<Eigen::Vector3d> points);

  /// Where points lie within half of the patch's half-length of its surface. A cell
  /// holds four of them on average.
  SupportedCells of(const Patch& patch) const;

private:
  std::vector<Eigen::Vector3d> points_; ///< by x
};

} // namespace holdfast::app
