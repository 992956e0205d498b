/// \file Rigid transforms between a local frame and the world (paper: X_f and X_r).
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// Pose of a local frame: q_world = R(r) q_local + c, in metres.
struct Pose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d c = Eigen::Vector3d::Zero();

  /// X_f: local to world.
  Eigen::Vector3d toWorld(const Eigen::Vector3d& local) const
  {
    return R * local + c;
  }

  /// X_r: world to local.
  Eigen::Vector3d toLocal(const Eigen::Vector3d& world) const
  {
    return R.transpose() * (world - c);
  }

  /// d toWorld / d(delta, c), 3x6, with R <- R Exp(delta) and c in world axes.
  Eigen::Matrix<double, 3, 6> toWorldJacobian(const Eigen::Vector3d& local) const;

  /// d toLocal / d(delta, c), 3x6, with R <- R Exp(delta) and c in world axes.
  Eigen::Matrix<double, 3, 6> toLocalJacobian(const Eigen::Vector3d& world) const;

  Pose inverse() const
  {
    return {R.transpose(), -(R.transpose() * c)};
  }

  /// (*this * other).toWorld(q) = toWorld(other.toWorld(q)).
  Pose operator*(const Pose& other) const
  {
    return {R * other.R, R * other.c + c};
  }
};

/// Exactly: no rotation, no translation.
inline bool
isIdentity(const Pose& pose)
{
  return pose.R.isIdentity(0.0) && pose.c.isZero(0.0);
}

} // namespace holdfast
