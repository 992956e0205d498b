#include <holdfast/sensor/stereo_noise_model.h>

#include "require.h"

namespace holdfast {

StereoNoiseModel::StereoNoiseModel(const Parameters& parameters)
: parameters_(parameters)
, lateral_per_z_(parameters.sigma_point_px / parameters.focal_px)
, radial_per_z_(parameters.sigma_disparity_px /
                (parameters.focal_px * parameters.baseline_m))
{
  requireNotNegative("sigma_point_px", parameters.sigma_point_px);
  requireNotNegative("sigma_disparity_px", parameters.sigma_disparity_px);
  requirePositive("baseline_m", parameters.baseline_m);
  requirePositive("focal_px", parameters.focal_px);
}

Eigen::Matrix3d
StereoNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  const double lateral = lateral_per_z_ * q.z();
  const Eigen::Vector3d radial = radial_per_z_ * q.z() * q;
  Eigen::Matrix3d Sigma = radial * radial.transpose();
  Sigma(0, 0) += lateral * lateral;
  Sigma(1, 1) += lateral * lateral;
  return Sigma;
}

void
StereoNoiseModel::covariances(int n,
                              const double* x,
                              const double* y,
                              const double* z,
                              const CovarianceChannels& out) const
{
  // __restrict and the local copies let the compiler vectorise the loop without checks.
  double* __restrict xx = out.xx;
  double* __restrict xy = out.xy;
  double* __restrict xz = out.xz;
  double* __restrict yy = out.yy;
  double* __restrict yz = out.yz;
  double* __restrict zz = out.zz;
  const double lateral = lateral_per_z_ * lateral_per_z_;
  const double radial = radial_per_z_ * radial_per_z_;
  for (int i = 0; i < n; ++i) {
    const double z2 = z[i] * z[i];
    const double a = lateral * z2;
    const double kx = radial * z2 * x[i];
    const double ky = radial * z2 * y[i];
    xx[i] = a + kx * x[i];
    xy[i] = kx * y[i];
    xz[i] = kx * z[i];
    yy[i] = a + ky * y[i];
    yz[i] = ky * z[i];
    zz[i] = radial * z2 * z2;
  }
}

Eigen::Vector3d
StereoNoiseModel::patternDirection(const Eigen::Vector3d& q) const
{
  return -q.z() / (parameters_.focal_px * parameters_.baseline_m) * q;
}

void
StereoNoiseModel::patternDirections(int n,
                                    const double* const point[3],
                                    double* const direction[3]) const
{
  const double per_z = -1.0 / (parameters_.focal_px * parameters_.baseline_m);
  const double* __restrict x = point[0];
  const double* __restrict y = point[1];
  const double* __restrict z = point[2];
  double* __restrict rx = direction[0];
  double* __restrict ry = direction[1];
  double* __restrict rz = direction[2];
  for (int i = 0; i < n; ++i) {
    const double scale = per_z * z[i];
    rx[i] = scale * x[i];
    ry[i] = scale * y[i];
    rz[i] = scale * z[i];
  }
}

std::string
StereoNoiseModel::name() const
{
  return "stereo";
}

} // namespace holdfast
