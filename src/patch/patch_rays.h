/// \file Rays from one place to one bounded patch.
#pragma once

#include "boundary_form.h"

#include <Eigen/Core>

#include <optional>

namespace holdfast {

/// intersectRay() of many rays from one origin: what depends on no ray is worked out
/// once.
class PatchRays {
public:
  PatchRays(const Patch& patch, const Eigen::Vector3d& origin);

  /// As intersectRay().
  std::optional<double> meet(const Eigen::Vector3d& direction) const;

private:
  /// Whether a local point of the unbounded surface belongs to the bounded patch.
  bool isOnPatch(const Eigen::Vector3d& local) const;

  Eigen::Matrix3d axes_; ///< world to local
  Eigen::Vector3d origin_; ///< local
  Eigen::Vector3d K_, K_origin_; ///< diagonal of K; half the gradient at the origin
  double c_; ///< f at the origin
  BoundaryForm boundary_;
  double kappa_; ///< of round surfaces, else 0
};

} // namespace holdfast
