/// \file The paper's parameters [d | k | r | c] as functions of a state.
#pragma once

#include <holdfast/patch/state.h>

namespace holdfast {

/// d^2 over the moment it belongs to: 2 erfinv(Gamma)^2 of stage II-4 for what is
/// bounded axis by axis, -2 ln(1 - Gamma) of II-9 for planes.
/// \throw std::invalid_argument when the containment Gamma is not in (0, 1).
double squaredBoundPerMoment(SurfaceType surface, double containment);

/// The state in the axes of its patch, x along the weaker curvature, of planes along
/// the larger moment, z the normal; canonical: x with non-negative world x. In these
/// axes the bounds of a narrow patch keep their digits, which a turn of its moments by
/// any angle would mix with those of its length.
struct StateAxes {
  PatchType type;
  Eigen::Matrix3d R; ///< to world; of round types any about the normal
  Eigen::Vector3d moments, curvature; ///< xx xy yy
  Eigen::Vector3d centre;
};

StateAxes axesOf(const PatchState& state);

PatchState stateIn(const StateAxes& axes);

/// d[M | k | nu | c] / d of the same in the axes of the patch; nu turns those, too.
StateMatrix stateByAxes(const StateAxes& axes);

/// The patch in canonical form. Bounds whose moment is not positive are zero.
/// \param squared_bound as from squaredBoundPerMoment().
Patch patchOf(const StateAxes& axes, double squared_bound);

/// d[d | k | r | c] / d[M | k | nu | c] in the axes of the patch. Finite where the
/// parameters are not observable; meaningless there.
using ParametersByAxes = Eigen::Matrix<double,
                                       Eigen::Dynamic,
                                       Eigen::Dynamic,
                                       Eigen::RowMajor | Eigen::DontAlign,
                                       kMaxParameters,
                                       kMaxState>;

ParametersByAxes parametersByAxes(const StateAxes& axes, double squared_bound);

} // namespace holdfast
