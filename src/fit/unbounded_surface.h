/// \file A surface, and the points it is fitted to, in the solver's terms.
#pragma once

#include "kernel.h"

#include <holdfast/geometry/rotation.h>

#include <Eigen/Core>

namespace holdfast {

/// Solver parameters theta in the order of kernel::Model, padded with zeros to six:
/// every surface then shares one fixed size. Unaligned, so that the layout is the same
/// for any instruction set.
using Theta = Eigen::Matrix<double, kernel::kMaxTheta, 1, Eigen::DontAlign>;
using ThetaMatrix =
    Eigen::Matrix<double, kernel::kMaxTheta, kernel::kMaxTheta, Eigen::DontAlign>;

/// Mean and scatter of the points, relative to the batch's origin.
struct Scatter {
  int count = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  /// Scatter about the mean over N, less the mean point covariance when debiased.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Principal axes, eigenvalues ascending; z is the normal, towards the viewpoint.
  Eigen::Vector3d eigenvalues = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();

  Eigen::Vector3d normal() const
  {
    return axes.col(2);
  }
};

/// An unbounded surface in the solver's terms.
struct UnboundedSurface {
  kernel::Model model = kernel::Model::Paraboloid;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity(); ///< local to world
  Eigen::Vector3d c = Eigen::Vector3d::Zero(); ///< relative to the batch's origin
  Eigen::Vector3d k = Eigen::Vector3d::Zero(); ///< kxx kxy kyy, or k 0 0
  double a = 0.0; ///< paraboloid: c = mean + a normal
};

/// The surface with its frame turned by delta, in its own axes, and its centre shifted
/// along them.
inline UnboundedSurface
movedFrame(const UnboundedSurface& surface,
           const Eigen::Vector3d& delta,
           const Eigen::Vector3d& shift)
{
  UnboundedSurface next = surface;
  next.R = surface.R * expMap(delta);
  next.c = surface.c + surface.R * shift;
  return next;
}

} // namespace holdfast
