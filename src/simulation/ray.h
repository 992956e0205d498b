/// \file Rays against boxes and against surfaces given by a function.
#pragma once

#include <Eigen/Core>

#include <boost/math/tools/toms748_solve.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace holdfast {

/// Part of a ray: origin + t direction, begin <= t <= end.
struct RayInterval {
  double begin = 0.0;
  double end = 0.0;
};

/// The part of a ray inside the box |x| <= half.x() ..., t of either sign.
inline std::optional<RayInterval>
clipToBox(const Eigen::Vector3d& origin,
          const Eigen::Vector3d& direction,
          const Eigen::Vector3d& half)
{
  RayInterval inside{-std::numeric_limits<double>::infinity(),
                     std::numeric_limits<double>::infinity()};
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (std::abs(origin[axis]) > half[axis])
        return std::nullopt;
      continue;
    }
    const double t1 = (-half[axis] - origin[axis]) / direction[axis];
    const double t2 = (half[axis] - origin[axis]) / direction[axis];
    inside.begin = std::max(inside.begin, std::min(t1, t2));
    inside.end = std::min(inside.end, std::max(t1, t2));
  }
  if (inside.begin > inside.end)
    return std::nullopt;
  return inside;
}

/// The first sign change of a continuous g in the interval, to rounding.
///
/// \param max_slope bound of |dg/dt|: steps of |g| / max_slope cannot jump over a zero.
/// Near a zero, steps are no smaller than 1/4096 of the interval, so a ray that only
/// grazes the surface within such a step may miss it.
template <typename Function>
std::optional<double>
firstRoot(const Function& g, const RayInterval& interval, double max_slope)
{
  const double smallest_step = (interval.end - interval.begin) / 4096.0;
  double t = interval.begin;
  double value = g(t);
  while (t < interval.end && value != 0.0) {
    const double step = std::max(std::abs(value) / max_slope, smallest_step);
    const double next = std::min(t + step, interval.end);
    const double next_value = g(next);
    if ((value < 0.0) != (next_value < 0.0)) {
      std::uintmax_t iterations = 100;
      const auto bracket = boost::math::tools::toms748_solve(
          g,
          t,
          next,
          value,
          next_value,
          boost::math::tools::eps_tolerance<double>(52),
          iterations);
      return 0.5 * (bracket.first + bracket.second);
    }
    t = next;
    value = next_value;
  }
  return value == 0.0 ? std::optional<double>(t) : std::nullopt;
}

} // namespace holdfast
