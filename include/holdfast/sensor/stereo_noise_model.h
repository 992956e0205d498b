/// \file Pointing and disparity noise of a stereo or structured-light sensor.
#pragma once

#include <holdfast/sensor/noise_model.h>

namespace holdfast {

/// Murray and Little, "Environment modeling with stereo vision", IROS 2004: a point is
/// measured as pixel (u, v), from the principal point, and disparity d,
///
///   x = u z / f,  y = v z / f,  z = f b / d,
///
/// with independent errors of standard deviation sigma_point_px in u and v and
/// sigma_disparity_px in d. To first order Sigma = J diag(sp^2, sp^2, sd^2) J^T,
///
///       | b/d   0   -b u/d^2 |   | z/f   0    -x z/(f b)  |
///   J = |  0   b/d  -b v/d^2 | = |  0   z/f   -y z/(f b)  |
///       |  0    0   -f b/d^2 |   |  0    0    -z^2/(f b)  |
///
/// which is a diag(1, 1, 0) + k q q^T with a = (sp z / f)^2, k = (sd z / (f b))^2. The
/// principal point is not needed.
class StereoNoiseModel : public NoiseModel {
public:
  /// The defaults are those of a first-generation Kinect.
  struct Parameters {
    double sigma_point_px = 0.35;
    double sigma_disparity_px = 0.17;
    double baseline_m = 0.075;
    double focal_px = 580.0; ///< of the image the disparity is measured in
  };

  /// \throw ParameterError for a negative sigma, a baseline or focal length that
  /// is not positive, or a number that is not finite.
  explicit StereoNoiseModel(const Parameters& parameters);

  Eigen::Matrix3d covariance(const Eigen::Vector3d& q) const override;
  void covariances(int n,
                   const double* x,
                   const double* y,
                   const double* z,
                   const CovarianceChannels& out) const override;
  /// Column d of J: m per px of disparity.
  Eigen::Vector3d patternDirection(const Eigen::Vector3d& q) const override;
  void patternDirections(int n,
                         const double* const point[3],
                         double* const direction[3]) const override;
  std::string name() const override;

  const Parameters& parameters() const
  {
    return parameters_;
  }

private:
  Parameters parameters_;
  double lateral_per_z_; ///< sqrt(a) / z
  double radial_per_z_; ///< sqrt(k) / z
};

} // namespace holdfast
