#include <holdfast/sensor/khoshelham_noise_model.h>

#include "require.h"

namespace holdfast {

KhoshelhamNoiseModel::KhoshelhamNoiseModel(const Parameters& parameters)
: parameters_(parameters)
{
  requireNotNegative("sigma_z_per_m2", parameters.sigma_z_per_m2);
  requireNotNegative("sigma_point_px", parameters.sigma_point_px);
  requirePositive("focal_px", parameters.focal_px);
}

Eigen::Matrix3d
KhoshelhamNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  const double z = q.z();
  const Eigen::Vector3d along = parameters_.sigma_z_per_m2 * z * q;
  const double lateral = parameters_.sigma_point_px * z / parameters_.focal_px;
  Eigen::Matrix3d Sigma = along * along.transpose();
  Sigma(0, 0) += lateral * lateral;
  Sigma(1, 1) += lateral * lateral;
  return Sigma;
}

std::string
KhoshelhamNoiseModel::name() const
{
  return "khoshelham";
}

} // namespace holdfast
