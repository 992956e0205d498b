#include <holdfast/sensor/quadratic_noise_model.h>

#include "require.h"

namespace holdfast {

QuadraticNoiseModel::QuadraticNoiseModel(const Parameters& parameters)
: parameters_(parameters)
{
  requireNotNegative("sigma_m", parameters.sigma_m);
  requireNotNegative("sigma_per_m2", parameters.sigma_per_m2);
  requireNotNegative("sigma_lateral_rad", parameters.sigma_lateral_rad);
}

Eigen::Matrix3d
QuadraticNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  const double r = q.norm();
  const double sigma = parameters_.sigma_m + parameters_.sigma_per_m2 * r * r;
  return rayCovariance(q, sigma, parameters_.sigma_lateral_rad * r);
}

std::string
QuadraticNoiseModel::name() const
{
  return "quadratic";
}

} // namespace holdfast
