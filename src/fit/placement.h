// Where a patch's frame lies on the fitted surface, and how it moves with the data.
#pragma once

#include "unbounded_surface.h"

namespace holdfast {

/// What a patch is a function of, in the axes of the surface's frame: theta (6), mean
/// (3), scatter (6), theta of the plane stage (3).
struct JointLayout {
  static constexpr int kTheta = 0;
  static constexpr int kMean = 6;
  static constexpr int kScatter = 9;
  static constexpr int kPlane = 15;
  static constexpr int kSize = 18;
};

/// Derivatives with respect to the joint variables, one row per component.
using JointRow = Eigen::Matrix<double, 1, JointLayout::kSize>;
using JointRows2 = Eigen::Matrix<double, 2, JointLayout::kSize, Eigen::RowMajor>;
using JointRows3 = Eigen::Matrix<double, 3, JointLayout::kSize, Eigen::RowMajor>;

/// A frame before its moments are looked at: columns of the joint are in the axes of
/// the surface's R, rows of delta and gamma = R^T dc in those of the final frame.
struct SurfacePlacement {
  Eigen::Matrix3d R;
  Eigen::Vector3d c; ///< relative to the batch's origin
  Eigen::Vector3d z; ///< normal at c, batch axes; of a sphere R does not follow it
  JointRows3 delta = JointRows3::Zero(), gamma = JointRows3::Zero();
};

/// What is placed, for one call: it refers to what it is made of.
struct PlacementRequest {
  const UnboundedSurface& surface;
  const Scatter& scatter;
  /// The weighted plane that gives sphere and cylinder their normal; null: the normal
  /// of the scatter.
  const UnboundedSurface* plane;
  bool centre_on_normal_line; ///< see FitOptions
};

/// The normal that a surface takes over, in its axes.
struct NormalMap {
  Eigen::Vector3d n;
  JointRows3 dn = JointRows3::Zero();
};

/// Of the plane where there is one, else of the scatter.
NormalMap normalMap(const PlacementRequest& request);

} // namespace holdfast
