#include <holdfast/noise_pattern.h>

#include <cmath>

namespace holdfast {

double
NoisePattern::variance() const
{
  return covariance(0.0);
}

double
NoisePattern::covariance(double distance_px) const
{
  double sum = 0.0;
  for (const PatternWave& wave : waves)
    sum +=
        wave.sigma * wave.sigma * correlation(wave.shape, distance_px / wave.length_px);
  return sum;
}

double
correlation(PatternShape shape, double t)
{
  return shape == PatternShape::Exponential ? std::exp(-t) : std::exp(-0.5 * t * t);
}

std::string
validityError(const NoisePattern& pattern)
{
  for (const PatternWave& wave : pattern.waves) {
    if (!std::isfinite(wave.sigma) || wave.sigma < 0.0)
      return "the sigma of a pattern must be a finite number, and not negative";
    if (!std::isfinite(wave.length_px) || wave.length_px <= 0.0)
      return "the length of a pattern must be a finite number > 0";
  }
  return {};
}

} // namespace holdfast
