#include <holdfast/sensor/noise_model.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace holdfast {

void
NoiseModel::covariances(int n,
                        const double* x,
                        const double* y,
                        const double* z,
                        const CovarianceChannels& out) const
{
  for (int i = 0; i < n; ++i) {
    const Eigen::Matrix3d Sigma = covariance({x[i], y[i], z[i]});
    out.xx[i] = Sigma(0, 0);
    out.xy[i] = Sigma(0, 1);
    out.xz[i] = Sigma(0, 2);
    out.yy[i] = Sigma(1, 1);
    out.yz[i] = Sigma(1, 2);
    out.zz[i] = Sigma(2, 2);
  }
}

Eigen::Vector3d
NoiseModel::patternDirection(const Eigen::Vector3d& q) const
{
  const Eigen::Vector3d ray = q.normalized();
  const double here = ray.dot(covariance(q) * ray);
  const double at_one_metre = ray.dot(covariance(ray) * ray);
  return at_one_metre > 0.0 ? Eigen::Vector3d(std::sqrt(here / at_one_metre) * ray) :
                              Eigen::Vector3d(Eigen::Vector3d::Zero());
}

void
NoiseModel::patternDirections(int n,
                              const double* const point[3],
                              double* const direction[3]) const
{
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d r = patternDirection({point[0][i], point[1][i], point[2][i]});
    for (int k = 0; k < 3; ++k)
      direction[k][i] = r[k];
  }
}

std::vector<Eigen::Matrix3f>
NoiseModel::imageCovariances(const std::vector<Eigen::Vector3d>& points,
                             int width,
                             int height) const
{
  if (width < 0 || height < 0 ||
      points.size() !=
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("imageCovariances: not width * height points");
  std::vector<Eigen::Matrix3f> result;
  result.reserve(points.size());
  for (const Eigen::Vector3d& q : points) {
    if (q.allFinite() && q.z() > 0.0)
      result.push_back(covariance(q).cast<float>());
    else
      result.push_back(
          Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  }
  return result;
}

Eigen::Matrix3d
rotateCovariance(const Eigen::Matrix3d& R, const Eigen::Matrix3d& Sigma)
{
  const Eigen::Matrix3d rotated = R * Sigma * R.transpose();
  return 0.5 * (rotated + rotated.transpose());
}

Eigen::Matrix3d
rayCovariance(const Eigen::Vector3d& q, double sigma_range_m, double sigma_lateral_m)
{
  const Eigen::Vector3d ray = q.normalized();
  const double lateral = sigma_lateral_m * sigma_lateral_m;
  // Projectors rather than a difference of variances: the sum of two positive
  // semi-definite matrices stays one in rounding.
  const Eigen::Matrix3d along = ray * ray.transpose();
  return sigma_range_m * sigma_range_m * along +
         lateral * (Eigen::Matrix3d::Identity() - along);
}

} // namespace holdfast
