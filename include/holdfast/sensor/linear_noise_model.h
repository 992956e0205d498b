/// \file Noise that grows linearly with the range, as of a time-of-flight camera or
/// laser.
#pragma once

#include <holdfast/sensor/noise_model.h>

namespace holdfast {

/// Standard deviation sigma_m + sigma_per_m r along the ray of range r = |q|, and
/// sigma_lateral_rad r across it.
class LinearNoiseModel : public NoiseModel {
public:
  struct Parameters {
    double sigma_m = 0.0; ///< at range zero
    double sigma_per_m = 0.001; ///< m per m
    double sigma_lateral_rad = 0.001; ///< angle between neighbouring rays, or less
  };

  /// \throw ParameterError for a parameter that is negative or not finite.
  explicit LinearNoiseModel(const Parameters& parameters);

  Eigen::Matrix3d covariance(const Eigen::Vector3d& q) const override;
  bool isOmnidirectional() const override
  {
    return true;
  }
  std::string name() const override;

private:
  Parameters parameters_;
};

} // namespace holdfast
