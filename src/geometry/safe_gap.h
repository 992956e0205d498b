#pragma once

#include <algorithm>
#include <cmath>

namespace holdfast {

/// A gap in the denominator. Differences of curvatures or moments this much smaller
/// than the values themselves are taken as this large: the axis is arbitrary then, and
/// its variance huge but finite.
inline double
safeGap(double gap, double scale)
{
  constexpr double kSmallestRelativeGap = 1e-6;
  const double smallest = std::max(kSmallestRelativeGap * scale, 1e-300);
  return std::abs(gap) < smallest ? std::copysign(smallest, gap) : gap;
}

} // namespace holdfast
