/// \file The surface through as few points as determine it.
///
/// Each solver returns an unbounded patch (d = 0) in no particular orientation, or
/// nothing where the points do not determine the surface: too close to each other, to a
/// line, a plane or a circle for coordinates that carry the rounding of `float`.
#pragma once

#include "fit/fit_patch.h"

#include <optional>
#include <vector>

namespace holdfast {

using Sample = std::vector<Eigen::Vector3d>;

/// Surfaces from the parameters PCL has for them; nothing where these make none.
std::optional<Patch> planePatch(const Eigen::Vector3d& normal,
                                const Eigen::Vector3d& point);
std::optional<Patch> spherePatch(const Eigen::Vector3d& centre, double radius_m);
std::optional<Patch> cylinderPatch(const Eigen::Vector3d& point,
                                   const Eigen::Vector3d& axis,
                                   double radius_m);

/// Three points.
std::optional<Patch> planeThrough(const Sample& sample);

/// Four points.
std::optional<Patch> sphereThrough(const Sample& sample);

/// Six points: up to six cylinders pass through the first five, the last one chooses.
std::optional<Patch> cylinderThrough(const Sample& sample);

/// Six points, as many as a paraboloid whose vertex lies on a given line has
/// parameters: the fit itself then passes through all of them. A type that the fitter's
/// options force is imposed afterwards. The normal points to the viewpoint's side.
std::optional<Patch> paraboloidThrough(const Sample& sample,
                                       const Eigen::Vector3d& viewpoint,
                                       const PatchFitter& fitter);

} // namespace holdfast
