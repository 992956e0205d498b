#include <holdfast/sensor/linear_noise_model.h>

#include "require.h"

namespace holdfast {

LinearNoiseModel::LinearNoiseModel(const Parameters& parameters)
: parameters_(parameters)
{
  requireNotNegative("sigma_m", parameters.sigma_m);
  requireNotNegative("sigma_per_m", parameters.sigma_per_m);
  requireNotNegative("sigma_lateral_rad", parameters.sigma_lateral_rad);
}

Eigen::Matrix3d
LinearNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  const double r = q.norm();
  const double sigma = parameters_.sigma_m + parameters_.sigma_per_m * r;
  return rayCovariance(q, sigma, parameters_.sigma_lateral_rad * r);
}

std::string
LinearNoiseModel::name() const
{
  return "linear";
}

} // namespace holdfast
