/// \file Between which bounds a mean of squared errors in sigmas lies when their
/// covariances are right.
#pragma once

#include <boost/math/distributions/chi_squared.hpp>

namespace holdfast::test {

/// One right implementation in so many falls out of bounds at a single seed.
constexpr double kFalseAlarm = 1e-3;

/// Of NEES per degree of freedom, over trials with so many degrees in all.
struct NeesBounds {
  double lowest, highest;

  explicit NeesBounds(int degrees)
  {
    const boost::math::chi_squared distribution(degrees);
    lowest = boost::math::quantile(distribution, 0.5 * kFalseAlarm) / degrees;
    highest = boost::math::quantile(
                  boost::math::complement(distribution, 0.5 * kFalseAlarm)) /
              degrees;
  }
};

/// Of the largest of so many squared errors of a pose.
inline double
largestOf(int trials)
{
  return boost::math::quantile(
      boost::math::complement(boost::math::chi_squared(6.0), kFalseAlarm / trials));
}

} // namespace holdfast::test
