/// \file The part of a depth camera's error that neighbouring pixels share.
///
/// The error of the range of pixel i is e_i = w_i + s(u_i): w white (temporal noise,
/// rounding), s a stationary field over the image with mean zero and
///
///     C(D) = sum_m sigma_m^2 rho(D / length_m),    D the distance in pixels.
///
/// On recorded Kinect tables s makes the error of a patch 3 to 12 times what white
/// noise of the same variance would; no residual inside the patch shows it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace holdfast {

/// rho of a distance t in lengths.
enum class PatternShape : std::uint8_t {
  Exponential, ///< exp(-t)
  Gaussian ///< exp(-t^2 / 2)
};

struct PatternWave {
  /// Standard deviation, in the unit of NoiseModel::patternDirection(): px of disparity
  /// for stereo sensors; for others m at a range of 1 m.
  double sigma = 0.0;
  double length_px = 1.0; ///< in pixels of the sensor's camera
  PatternShape shape = PatternShape::Gaussian;
};

/// The noise model's own covariances are those of single points, white part and pattern
/// together: the pattern says how much of it neighbours share.
struct NoisePattern {
  std::vector<PatternWave> waves; ///< none: errors are independent

  bool empty() const
  {
    return waves.empty();
  }

  /// C(0): that of a single point.
  double variance() const;

  /// C(D) of two points D px apart.
  double covariance(double distance_px) const;
};

/// rho(t).
double correlation(PatternShape shape, double t);

/// Empty when the pattern makes sense, else one sentence naming the first thing that
/// does not: a sigma that is negative, a length that is not positive, a number that is
/// not finite.
std::string validityError(const NoisePattern& pattern);

} // namespace holdfast
