#include <holdfast/correlated_noise.h>

#include <cmath>
#include <stdexcept>
#include <utility>

namespace holdfast {
namespace {

using Component = CorrelatedNoise::Component;

// The trapezoidal rule over ln s, then scaled so that the weights sum to one (the
// variance) and the mean of s^2 is one (the sum over the plane).
void
addExponential(const PatternWave& wave, std::vector<Component>& components)
{
  constexpr int kFirst = -5, kLast = 1;
  constexpr double kStep = 0.75; // of ln s
  double sum = 0.0, sum_of_squares = 0.0;
  const auto weight = [](double s) { return s * std::exp(-0.5 * s * s); };
  for (int k = kFirst; k <= kLast; ++k) {
    const double s = std::exp(kStep * k);
    sum += weight(s);
    sum_of_squares += weight(s) * s * s;
  }
  const double stretch = std::sqrt(sum / sum_of_squares);
  for (int k = kFirst; k <= kLast; ++k) {
    const double s = std::exp(kStep * k);
    components.push_back(
        {wave.sigma * wave.sigma * weight(s) / sum, wave.length_px * stretch * s});
  }
}

} // namespace

CorrelatedNoise::CorrelatedNoise(NoisePattern pattern) : pattern_(std::move(pattern))
{
  if (const std::string error = validityError(pattern_); !error.empty())
    throw std::invalid_argument(error);
  for (const PatternWave& wave : pattern_.waves)
    if (wave.shape == PatternShape::Exponential)
      addExponential(wave, components_);
    else
      components_.push_back({wave.sigma * wave.sigma, wave.length_px});
}

double
CorrelatedNoise::variance() const
{
  double sum = 0.0;
  for (const Component& wave : components_)
    sum += wave.variance;
  return sum;
}

} // namespace holdfast
