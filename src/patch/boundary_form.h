/// \file A boundary in the form in which many points are compared with it.
#pragma once

#include <holdfast/patch/patch.h>

#include <algorithm>

namespace holdfast {

/// How far out a local (x, y) lies, as one number that is 1 on the boundary and grows
/// from the centre outwards.
struct BoundaryForm {
  /// A point on the boundary may lie outside by rounding.
  static constexpr double kEdge = 1.0 + 1e-12;

  explicit BoundaryForm(const Patch& patch);

  /// Ellipse and circle: (x ax)^2 + (y ay)^2, in the first entries (paper eq. (2));
  /// rectangle and quad: the largest ax x + ay y among the four sides.
  bool is_ellipse;
  double ax[4], ay[4];

  double reach(double x, double y) const
  {
    if (is_ellipse)
      return ax[0] * x * ax[0] * x + ay[0] * y * ay[0] * y;
    return std::max(std::max(ax[0] * x + ay[0] * y, ax[1] * x + ay[1] * y),
                    std::max(ax[2] * x + ay[2] * y, ax[3] * x + ay[3] * y));
  }

  bool contains(double x, double y) const
  {
    return reach(x, y) <= kEdge;
  }
};

} // namespace holdfast
