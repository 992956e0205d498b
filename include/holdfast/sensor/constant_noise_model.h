/// \file The same noise at every distance.
#pragma once

#include <holdfast/sensor/noise_model.h>

namespace holdfast {

/// Standard deviation sigma_m along the ray and sigma_lateral_m across it; isotropic
/// when the two are equal.
class ConstantNoiseModel : public NoiseModel {
public:
  struct Parameters {
    double sigma_m = 0.001;
    double sigma_lateral_m = 0.001;
  };

  /// \throw ParameterError for a sigma that is negative or not finite.
  explicit ConstantNoiseModel(const Parameters& parameters);

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
