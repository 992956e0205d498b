// Closed-form starts of the surface fits: what the models' own starts are made of.
#pragma once

#include "unbounded_surface.h"

#include <optional>

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

// What a start is made from, for one call: it refers to what it is made of.
struct StartRequest {
  Residual residual;
  const kernel::Points& points;
  const Scatter& scatter;
};

// The least-squares quadric as a surface, its frame where the line along the principal
// normal meets it; k: kxx kxy kyy.
UnboundedSurface quadricStart(kernel::Model model, const StartRequest& request);

// Whether the points wrap around a sphere or cylinder too far for a height field.
bool isThick(const Scatter& scatter);

// Sphere or, in the plane that `projector` leaves, circle.
struct AlgebraicCentre {
  Eigen::Vector3d centre; // relative to the mean
  double radius;
};

// By algebraic least squares (Kasa): |q|^2 = 2 centre.q + e. Empty directions (the
// axis) are left out. None where the points determine no centre.
std::optional<AlgebraicCentre> algebraicCentre(const StartRequest& request,
                                               const Eigen::Matrix3d& projector);

// A surface around the centre, its frame where the unit vector z, from the centre,
// leaves it; the side on which the points are decides the sign of the curvature.
UnboundedSurface surfaceAround(kernel::Model model,
                               const AlgebraicCentre& found,
                               const Eigen::Vector3d& mean,
                               const Eigen::Vector3d& z,
                               const Eigen::Vector3d& x);

// The start that costs least among those considered; the former one of equals.
class CheapestStart {
public:
  CheapestStart(const StartRequest& request, const UnboundedSurface& first);

  void consider(const UnboundedSurface& candidate);

  const UnboundedSurface& surface() const
  {
    return best_;
  }

private:
  const StartRequest& request_;
  UnboundedSurface best_;
  double lowest_;
};

} // namespace holdfast
