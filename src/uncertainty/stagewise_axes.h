// Principal axes of a symmetric 2x2 matrix, with their derivatives.
#pragma once

#include "uncertainty/stagewise_stages.h"

#include <holdfast/geometry/constants.h>

#include <algorithm>
#include <cmath>

namespace holdfast { namespace stagewise {

// Of [alpha beta/2; beta/2 phi] (rho of stage II-9): D = beta^2 + (alpha - phi)^2 and
// the angle of the larger eigenvalue, t = atan2(beta, alpha - phi)/2. Derivatives are
// rows with respect to (alpha, beta, phi).
struct PrincipalAxes {
  double angle, larger, smaller, cosine, sine, root_D;

  PrincipalAxes(double alpha, double beta, double phi)
  : angle(0.5 * std::atan2(beta, alpha - phi))
  , cosine(std::cos(2.0 * angle))
  , sine(std::sin(2.0 * angle))
  , root_D(std::hypot(beta, alpha - phi))
  {
    larger = 0.5 * (alpha + phi + root_D);
    smaller = 0.5 * (alpha + phi - root_D);
  }

  Eigen::RowVector3d dlarger() const
  {
    return 0.5 * Eigen::RowVector3d(1.0 + cosine, sine, 1.0 - cosine);
  }

  Eigen::RowVector3d dsmaller() const
  {
    return 0.5 * Eigen::RowVector3d(1.0 - cosine, -sine, 1.0 + cosine);
  }

  // [-beta, alpha - phi, beta] / (2 D): the printed dt/drho of eq. (17) lacks it. Where
  // the eigenvalues agree to six digits the angle is arbitrary, and its variance
  // limited to something huge.
  Eigen::RowVector3d dangle() const
  {
    constexpr double kSmallestRelativeGap = 1e-6;
    const double scale = std::max(std::abs(larger), std::abs(smaller));
    const double gap = std::max({root_D, kSmallestRelativeGap * scale, 1e-300});
    return Eigen::RowVector3d(-sine, cosine, sine) / (2.0 * gap);
  }
};

}} // namespace holdfast::stagewise
