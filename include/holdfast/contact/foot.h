/// \file What touches the surface: a sole or finger pad, its ankle, its friction, and
/// what it may bear.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace holdfast {

enum class Ankle : std::uint8_t {
  Compliant, ///< the sole turns until it lies on the surface
  Stiff ///< the sole keeps the orientation that was planned
};

/// Coefficient of friction: lognormal, since it is positive.
struct Friction {
  double mean = 0.6;
  double sigma = 0.1; ///< standard deviation, at most the mean; 0: known exactly
};

/// Beyond these a contact counts as failed.
struct ContactTolerances {
  /// Height of the surface at the planned point, along the load, off what was planned.
  double height_m = 0.02;
  /// Of the surface against a stiff ankle's sole.
  double tilt_rad = 0.1;
  /// Distance of the surface from the sole, once that lies on it as well as it can.
  double gap_m = 0.008;
  /// Where the surface is nearer to the sole than this it counts as in contact.
  double contact_m = 0.003;
  /// Share of the sole that has to lie on surface that was seen.
  double min_support = 0.9;
};

/// In the frame of the sole: origin where the load acts, x forward, z out of the
/// surface, into the leg.
struct Foot {
  std::string name = "foot";
  /// Corners of the sole, m, in either sense of rotation.
  std::vector<Eigen::Vector2d> sole;
  /// Of the sole along its x and y, 1/m; positive like a ball's that lies on the
  /// ground.
  Eigen::Vector2d curvature = Eigen::Vector2d::Zero();
  Ankle ankle = Ankle::Compliant;
  Friction friction;
  ContactTolerances tolerances;
};

/// A flat sole of length (x) and width (y), m, with the load in its middle.
Foot rectangularFoot(double length_m, double width_m);

/// Empty when the foot makes sense, else one sentence naming the first thing that does
/// not: fewer than three corners, edges that cross, no area, less than 1 mm, numbers
/// that are negative or not finite, a friction of which nothing is known.
std::string validityError(const Foot& foot);

double soleArea(const Foot& foot); ///< m^2

/// Distance of the farthest corner from the origin, m: patches must be known that far.
double soleReach(const Foot& foot);

/// Radius of patches that know the surface a little beyond the sole, m; smaller ones
/// than 4 cm have too few points of a depth camera at 1 m to be sure of a slope.
double patchRadiusFor(const Foot& foot);

} // namespace holdfast
