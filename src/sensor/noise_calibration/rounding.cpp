#include <holdfast/geometry/constants.h>
#include <holdfast/sensor/noise_calibration.h>

namespace holdfast {

/// With Q1 - Q2 = k q for the difference delta = (k + f) q of the values before
/// rounding, 0 <= f < 1, with probability 1 - f over the position between two steps,
/// and (k + 1) q with probability f,
///
///   E (Q1 - Q2)^2 = q^2 ((1 - f) k^2 + f (k + 1)^2) = delta^2 + q^2 f (1 - f).
///
/// f (1 - f) = 1/6 - sum_m cos(2 pi m f) / (pi m)^2, m = 1, 2, ..., and delta is normal
/// with variance 2 sigma^2, for which E cos(2 pi m delta / q) =
/// exp(-4 pi^2 m^2 sigma^2 / q^2). Together:
///
///   E (Q1 - Q2)^2 / 2 = sigma^2 + q^2 / 12
///                       - q^2 / (2 pi^2) sum_m exp(-(2 pi m sigma / q)^2) / m^2.
double
roundedTemporalVariance(double sigma_px, double quantum_px)
{
  const double ratio = sigma_px / quantum_px;
  // Below, the series is slow, and all that happens is a single step now and then:
  // f = |delta| / q is small, E (Q1 - Q2)^2 = q E |delta|, exactly but for
  // exp(-1 / (4 ratio^2)).
  if (ratio < 0.1)
    return quantum_px * sigma_px / std::sqrt(kPi);
  double sum = 0.0;
  for (int m = 1;; ++m) {
    const double term = std::exp(-std::pow(2.0 * kPi * m * ratio, 2)) / (m * m);
    sum += term;
    if (term < 1e-17)
      break;
  }
  return sigma_px * sigma_px +
         quantum_px * quantum_px * (1.0 / 12.0 - sum / (2.0 * kPi * kPi));
}

double
sigmaBeforeRounding(double variance_px2, double quantum_px)
{
  if (variance_px2 <= 0.0)
    return 0.0;
  if (!std::isfinite(variance_px2))
    return variance_px2;
  // Rounding only adds variance, and the sum grows with sigma.
  double low = 0.0, high = std::sqrt(variance_px2);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (roundedTemporalVariance(middle, quantum_px) < variance_px2 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

} // namespace holdfast
