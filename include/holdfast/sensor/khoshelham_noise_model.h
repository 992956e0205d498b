/// \file The Kinect's random depth error as measured by Khoshelham and Elberink.
#pragma once

#include <holdfast/sensor/noise_model.h>

namespace holdfast {

/// Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data for indoor
/// mapping applications", Sensors 12 (2012). Depth comes from a disparity that the
/// sensor reports with normalisation slope m: 1/z = m d' + n, so that
///
///   sigma_z = (m / (f b)) z^2 sigma_d' = 1.425e-3 z^2      (z and sigma_z in metres)
///
/// with their calibrated m / (f b) = 2.85e-5 1/cm and sigma_d' = 1/2. Since
/// x = u z / f and y = v z / f, the same error moves the point along its ray:
/// sigma_x = |x/z| sigma_z and sigma_y = |y/z| sigma_z, fully correlated. They neglect
/// the pointing error; sigma_point_px of a pixel across the ray is added here,
///
///   Sigma = sigma_z^2 (q/z) (q/z)^T + (sigma_point z / f)^2 diag(1, 1, 0).
class KhoshelhamNoiseModel : public NoiseModel {
public:
  struct Parameters {
    double sigma_z_per_m2 = 1.425e-3; ///< m per m^2
    double sigma_point_px = 0.35;
    double focal_px = 580.0;
  };

  /// \throw ParameterError for a negative sigma, a focal length that is not
  /// positive, or a number that is not finite.
  explicit KhoshelhamNoiseModel(const Parameters& parameters);

  Eigen::Matrix3d covariance(const Eigen::Vector3d& q) const override;
  std::string name() const override;

private:
  Parameters parameters_;
};

} // namespace holdfast
