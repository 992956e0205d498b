/// \file One bounded patch as a geometric thing; how it is fitted is elsewhere.
#pragma once

#include <holdfast/geometry/pose.h>
#include <holdfast/patch/types.h>

#include <Eigen/Core>

#include <string>

namespace holdfast {

/// A bounded curved patch. Units: metres, radians, 1/metre.
///
/// Local frame: origin c on the surface, z its normal there, pointing to the side the
/// patch was seen from. With z = (kappa_x x^2 + kappa_y y^2)/2 a positive curvature
/// bends towards the viewer (bowl), a negative one away (rock top).
struct Patch {
  PatchType type;
  /// d: ellipse (dx, dy), circle (d), rectangle (dx, dy) half-lengths, quad (d1..d4 the
  /// corner distances, gamma the half-angle between diagonals); unused entries are
  /// zero.
  Eigen::Matrix<double, 5, 1> d = Eigen::Matrix<double, 5, 1>::Zero();
  /// kappa: (kappa_x, kappa_y) of elliptic and hyperbolic paraboloids, (kappa, 0) of
  /// one-curvature surfaces, zero for planes.
  Eigen::Vector2d kappa = Eigen::Vector2d::Zero();
  /// Exponential coordinates of the orientation; r_z = 0 for revolute types.
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  /// Centre, world frame.
  Eigen::Vector3d c = Eigen::Vector3d::Zero();

  Pose pose() const;

  /// Curvatures along local x and y at the centre: (0, kappa) for cylinders and
  /// cylindric paraboloids, (kappa, kappa) for spheres and circular paraboloids.
  Eigen::Vector2d principalCurvatures() const;

  /// Unit normal at the centre, world frame.
  Eigen::Vector3d normal() const;
};

/// Empty when the patch is valid; else one sentence that names the first thing wrong:
/// an illegal type pair, a non-finite number, a bound <= 0, gamma outside (0, pi/2), an
/// unused entry that is not zero, a curvature of zero on a curved surface, kappas whose
/// signs contradict the type, |r| > pi, r_z != 0 for a revolute type.
std::string validityError(const Patch& patch);

/// The one representative of equal patches: |kappa_x| <= |kappa_y| (axes and bounds
/// swapped together), x axis with non-negative world x component (if that is zero
/// within rounding: y, then z), |r| <= pi, revolute types with r_z = 0. Without
/// curvatures to order them, the axes of a plane are never swapped.
Patch canonical(const Patch& patch);

/// The same patch seen from another frame: pose' = T * pose (then canonical).
Patch transformed(const Patch& patch, const Pose& T);

/// The same surface and boundary written with the parameters nearest to the reference:
/// x axis and axes of equal rank turned by multiples of pi/2 (bounds and kappas with
/// them), and r or r (1 - 2 pi/|r|), which is the same rotation. The result need not be
/// canonical. For differences between patches, which canonical form alone would break
/// at its edges.
Patch nearestRepresentation(const Patch& patch, const Patch& reference);

} // namespace holdfast
