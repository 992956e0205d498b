/// \file The regular coordinates of a patch: those its covariance is always right in.
///
/// The paper's parameters [d | k | r | c] are singular where an axis is lost: bounds,
/// principal curvatures and r_z of a patch that is (nearly) as curved or as long both
/// ways depend on the points in no linear way, and r_xy is none at |r_xy| = pi, exactly
/// where a camera looks straight at a surface. The state has none of these places: the
/// second moments of the support and the curvature matrix in the tangent plane, the
/// normal, and the centre. The parameters are functions of it.
#pragma once

#include <holdfast/patch/parameters.h>

#include <Eigen/Core>

#include <string>
#include <vector>

namespace holdfast {

struct PatchState {
  PatchType type;
  /// xx xy yy of the support about the centre, m^2, axes of frame(). The bounds are
  /// multiples of their roots: FitOptions::containment.
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();
  /// kxx kxy kyy of z = (kxx x^2 + 2 kxy xy + kyy y^2) / 2, 1/m, axes of frame(); of
  /// paraboloids the fitted matrix, whatever their type says of it; zero for planes.
  Eigen::Vector3d curvature = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(); ///< unit, world frame
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< on the surface, world frame, m

  /// Local to world: z is the normal, x as frameFromZ() chooses it.
  Eigen::Matrix3d frame() const;
};

inline constexpr int kMaxState = 11;

/// Coordinates of a state near a reference: [M | k | nu | c]. nu turns the frame of the
/// reference about an axis in its xy plane, R Exp([nu_x nu_y 0]), so that it does not
/// twist about the normal; M and k are in the axes of the turned frame.
using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxState, 1>;
using StateMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxState, kMaxState>;

/// Where each group starts and how long it is. Round types have one moment and one
/// curvature, planes no curvature; other surfaces three each.
struct StateLayout {
  int m_count = 0;
  int k_count = 0;

  int k() const
  {
    return m_count;
  }
  int nu() const
  {
    return m_count + k_count;
  }
  int c() const
  {
    return nu() + 2;
  }
  int size() const
  {
    return c() + 3;
  }
};

StateLayout stateLayoutOf(PatchType type);

/// "M_xx", "k_xy", "nu_x", "c_z", ... in the order of the coordinates.
std::vector<std::string> stateNames(PatchType type);

/// The state's own coordinates: its nu is zero.
StateVector pack(const PatchState& state);

/// The state with these coordinates, nu left out, and this normal: the inverse of
/// pack().
/// \throw std::invalid_argument when their number is not that of the type.
PatchState unpackState(PatchType type,
                       const StateVector& coordinates,
                       const Eigen::Vector3d& normal);

/// Coordinates of `state` about the reference, less those of the reference.
/// \throw std::invalid_argument when they are of different types.
StateVector difference(const PatchState& state, const PatchState& reference);

/// The patch that the state describes, in canonical form. What cannot be told, such as
/// the axes of a round bowl, is decided by rounding.
/// \param containment Gamma in (0, 1), FitOptions::containment.
/// \throw std::invalid_argument for any other.
Patch toPatch(const PatchState& state, double containment);

/// The state that toPatch() makes this patch from. Cylindric paraboloids get a
/// curvature matrix of rank one, and what has axes of its own moments along them.
/// \throw std::invalid_argument as toPatch().
PatchState toState(const Patch& patch, double containment);

} // namespace holdfast
