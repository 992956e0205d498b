/// \file How far points lie from the surface of a patch (as in SPL: Kanoulas & Vona,
/// ICRA 2013).
///
/// Distances are to the *unbounded* surface: for a point beside the patch, the distance
/// to the bounded one would measure the boundary instead, which is the business of
/// holdfast/validation/coverage.h.
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/patch/patch.h>

#include <Eigen/Core>

#include <vector>

namespace holdfast {

/// Euclidean distance from a world point to the unbounded surface of a valid patch, m;
/// positive on the side of the normal. Exact: in closed form for the plane, the whole
/// sphere and the whole cylinder, from the nearest of all foot points for paraboloids,
/// also beyond their centres of curvature.
double distanceToSurface(const Patch& patch, const Eigen::Vector3d& point);

/// distanceToSurface() of many points, which is cheaper for each.
std::vector<double> distancesToSurface(const Patch& patch,
                                       const std::vector<Eigen::Vector3d>& points);

/// The point of the unbounded surface that is nearest to a world point, world frame, m;
/// one of them where there are several.
Eigen::Vector3d nearestSurfacePoint(const Patch& patch, const Eigen::Vector3d& point);

/// As distanceToSurface(), but along the gradient of the implicit form at the point
/// instead of the normal at its foot. Exact for plane, sphere and cylinder. For a point
/// at distance t from a paraboloid of curvature kappa the magnitude is too large by a
/// share of less than (kappa t)^2 / 8 / (1 - kappa t)^2; not to be used beyond
/// kappa t = 0.5.
double approximateDistanceToSurface(const Patch& patch, const Eigen::Vector3d& point);

/// A single point within as many of its sigmas may be noise: one patch of five hundred
/// points in thirty has one beyond by chance.
inline constexpr double kNoiseSigmas = 4.0;

/// Distances of the points of a neighbourhood to the surface of a patch.
struct SurfaceResidual {
  double rms_m = 0.0; ///< root of the mean squared distance
  double largest_m = 0.0;
  /// Largest of those that the noise does not explain: of points that are further off
  /// than kNoiseSigmas of their own sigmas along the patch's normal. Of points without
  /// covariances largest_m.
  double unexplained_m = 0.0;
  int points = 0; ///< those that are finite; without any, the others are zero
};

/// Takes no memory from the heap. Each distance is right to a thousandth of itself: the
/// approximation where that is good enough, else the exact one.
SurfaceResidual measureResidual(const Patch& patch, const PointBatch& points);

/// \param points in world coordinates; those that are not finite are left out.
SurfaceResidual measureResidual(const Patch& patch,
                                const std::vector<Eigen::Vector3d>& points);

} // namespace holdfast
