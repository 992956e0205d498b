#include <holdfast/sensor/constant_noise_model.h>

#include "require.h"

namespace holdfast {

ConstantNoiseModel::ConstantNoiseModel(const Parameters& parameters)
: parameters_(parameters)
{
  requireNotNegative("sigma_m", parameters.sigma_m);
  requireNotNegative("sigma_lateral_m", parameters.sigma_lateral_m);
}

Eigen::Matrix3d
ConstantNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  // The isotropic case needs no ray, so that it serves clouds around the origin too.
  if (parameters_.sigma_m == parameters_.sigma_lateral_m)
    return parameters_.sigma_m * parameters_.sigma_m * Eigen::Matrix3d::Identity();
  return rayCovariance(q, parameters_.sigma_m, parameters_.sigma_lateral_m);
}

std::string
ConstantNoiseModel::name() const
{
  return "constant";
}

} // namespace holdfast
