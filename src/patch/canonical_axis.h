/// \file Which of two opposite directions is the canonical one.
#pragma once

#include <Eigen/Core>

#include <cmath>

namespace holdfast {

/// True when the first of x, y, z that is not zero within rounding is negative.
inline bool
pointsBackwards(const Eigen::Vector3d& axis)
{
  // A component smaller than this is rounding and does not decide the sign.
  constexpr double kZeroComponent = 1e-12;
  for (const double component : axis)
    if (std::abs(component) >= kZeroComponent)
      return component < 0.0;
  return false;
}

} // namespace holdfast
