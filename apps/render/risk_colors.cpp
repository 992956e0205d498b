#include "render/risk_colors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace holdfast::app {

double
riskFraction(double total)
{
  constexpr double kLeast = 1e-3;
  return 1.0 - std::log(std::clamp(total, kLeast, 1.0)) / std::log(kLeast);
}

Rgb
riskColor(double total)
{
  return riskScaleColor(riskFraction(total));
}

Rgb
riskScaleColor(double place)
{
  // From green over yellow to red, each of another brightness.
  constexpr std::array<Rgb, 3> kStops{{{26, 130, 60}, {250, 220, 90}, {190, 20, 40}}};
  const double t = 2.0 * std::clamp(place, 0.0, 1.0);
  const std::size_t first = t < 1.0 ? 0 : 1;
  const double share = t - static_cast<double>(first);
  Rgb color;
  for (std::size_t i = 0; i < color.size(); ++i)
    color[i] = static_cast<std::uint8_t>(
        std::lround((1.0 - share) * kStops[first][i] + share * kStops[first + 1][i]));
  return color;
}

} // namespace holdfast::app
