// Closed-form starts of the surface fits.
#pragma once

#include "surface_fit.h"

namespace holdfast {

// z = a0 + slope.(x, y) + kxx x^2/2 + kxy x y + kyy y^2/2 over the principal frame.
struct Quadric {
  double a0 = 0.0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  Eigen::Vector3d k = Eigen::Vector3d::Zero(); // kxx kxy kyy
};

// Unweighted least squares; a plane through the mean where the points do not determine
// the quadric.
Quadric leastSquaresQuadric(const kernel::Points& points, const Scatter& scatter);

// Whether the points wrap around a sphere or cylinder too far for a height field.
bool isThick(kernel::Model model, const Scatter& scatter);

// A start about one sigma from the solution: the least-squares quadric over the
// principal frame. Where that is too thick, algebraic fits compete with it and the
// lowest cost wins.
UnboundedSurface surfaceStart(kernel::Model model,
                              Residual residual,
                              const kernel::Points& points,
                              const Scatter& scatter);

} // namespace holdfast
