#include "render/risk_colors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace holdfast::app {

double
riskFraction(double total)
{
  return 1.0 - std::log(std::clamp(total, kLeastRisk, 1.0)) / std::log(kLeastRisk);
}

Rgb
riskColor(double total)
{
  return riskScaleColor(riskFraction(total));
}

Rgb
riskScaleColor(double place)
{
  const double t = 2.0 * std::clamp(place, 0.0, 1.0);
  const std::size_t first = t < 1.0 ? 0 : 1;
  const double share = t - static_cast<double>(first);
  Rgb color;
  for (std::size_t i = 0; i < color.size(); ++i)
    color[i] = static_cast<std::uint8_t>(std::lround(
        (1.0 - share) * kRiskColors[first][i] + share * kRiskColors[first + 1][i]));
  return color;
}

} // namespace holdfast::app
