#include <holdfast/geometry/pose.h>
#include <holdfast/geometry/rotation.h>

namespace holdfast {

Eigen::Matrix<double, 3, 6>
Pose::toWorldJacobian(const Eigen::Vector3d& local) const
{
  Eigen::Matrix<double, 3, 6> J;
  J << -R * skew(local), Eigen::Matrix3d::Identity();
  return J;
}

Eigen::Matrix<double, 3, 6>
Pose::toLocalJacobian(const Eigen::Vector3d& world) const
{
  // (R Exp(delta))^T (q - c) = Exp(-delta) q_l = q_l + q_l x delta + ...
  Eigen::Matrix<double, 3, 6> J;
  J << skew(toLocal(world)), -R.transpose();
  return J;
}

} // namespace holdfast
