/// \file A noise pattern made ready for the covariance of fits.
#pragma once

#include <holdfast/noise_pattern.h>

#include <vector>

namespace holdfast {

/// A pattern as a sum of Gaussian waves, whose sums over the pixels of a patch are
/// cheap. Made once for a sensor; batches share it.
class CorrelatedNoise {
public:
  /// A wave of covariance variance exp(-D^2 / (2 length^2)).
  struct Component {
    double variance;
    double length_px;
  };

  /// An exponential wave is taken as seven Gaussian ones, from
  ///
  ///     exp(-t) = E exp(-t^2 / (2 s^2)),   s half-normal: sqrt(2/pi) exp(-s^2/2) ds,
  ///
  /// in steps of equal ratio from s = 0.02 to 2.1: variance and sum over the plane are
  /// exact, and beyond a tenth of a length it is within 0.01 of it.
  /// \throw std::invalid_argument when the pattern makes no sense (validityError).
  explicit CorrelatedNoise(NoisePattern pattern);

  const NoisePattern& pattern() const
  {
    return pattern_;
  }

  const std::vector<Component>& components() const
  {
    return components_;
  }

  /// Of a single pixel.
  double variance() const;

private:
  NoisePattern pattern_;
  std::vector<Component> components_;
};

} // namespace holdfast
