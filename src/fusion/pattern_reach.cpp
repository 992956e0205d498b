#include <holdfast/fusion/pattern_reach.h>

#include <algorithm>
#include <cmath>

namespace holdfast {

std::vector<PatternReach>
patternReach(const CorrelatedNoise& noise, double focal_px)
{
  std::vector<PatternReach> waves;
  for (const CorrelatedNoise::Component& wave : noise.components())
    waves.push_back({wave.variance, wave.length_px / focal_px});
  return waves;
}

std::vector<PatternReach>
singleWave(double length)
{
  return {{1.0, length}};
}

Eigen::Vector3d
patternCorrelation(const std::vector<PatternReach>& waves, double support, double moved)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), left = Eigen::Vector3d::Zero();
  for (const PatternReach& wave : waves) {
    const double l = wave.length * wave.length, s = support * support;
    const double L = l + 2.0 * s;
    if (!(L > 0.0))
      continue;
    const double t = moved * moved / L;
    const double decay = std::exp(-0.5 * t);
    // Averages over the directions of the motion of 1 - t cos^2 and its square's like.
    const double kept[3] = {1.0,
                            std::max(0.0, 1.0 - 0.5 * t),
                            std::max(0.0, 1.0 - t + 0.125 * t * t)};
    double variance = wave.variance * l / L;
    for (int n = 0; n < 3; ++n) {
      sum[n] += variance;
      left[n] += variance * decay * kept[n];
      variance *= s / L;
    }
  }
  for (int n = 0; n < 3; ++n)
    left[n] = sum[n] > 0.0 ? left[n] / sum[n] : 0.0;
  return left;
}

} // namespace holdfast
