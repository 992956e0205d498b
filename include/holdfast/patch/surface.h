/// \file The unbounded surface of a patch.
///
/// Implicit form (paper eq. (1)): f(q) = q_l^T K q_l - 2 z_l with
/// q_l = R^T (q - c), and K = diag(kx, ky, 0) for paraboloids, k I for the sphere,
/// diag(0, k, k) for the circular cylinder (axis: local x), 0 for the plane.
#pragma once

#include <holdfast/patch/patch.h>

#include <optional>

namespace holdfast {

/// Diagonal of K in the local frame.
Eigen::Vector3d implicitDiagonal(const Patch& patch);

/// f at a world point, in metres (about -2 times the height above the surface).
double implicitValue(const Patch& patch, const Eigen::Vector3d& world);

/// df/dq at a world point, in world axes (points away from the normal's side).
Eigen::Vector3d implicitGradient(const Patch& patch, const Eigen::Vector3d& world);

/// z over the local (x, y) on the sheet through the centre, the half of a sphere or
/// cylinder up to its equator; nothing where that has no surface over the point. The
/// equator itself counts as surface.
std::optional<double> height(const Patch& patch, double x, double y);

/// Unit normal over the local (x, y), world axes, on the side of local z; nothing where
/// height() has none.
std::optional<Eigen::Vector3d> normalAt(const Patch& patch, double x, double y);

/// The smallest t >= 0 at which origin + t direction meets the *bounded* patch (the
/// part of the surface, on the sheet through the centre, whose projection is inside the
/// boundary); nothing where it misses. `direction` need not be a unit vector.
std::optional<double> intersectRay(const Patch& patch,
                                   const Eigen::Vector3d& origin,
                                   const Eigen::Vector3d& direction);

} // namespace holdfast
