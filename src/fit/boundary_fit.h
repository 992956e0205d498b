/// \file From an unbounded surface to a bounded patch: paper stages II-4 to II-9.
///
/// The bounds are functions of the projected points' moments, so the whole patch is a
/// function of theta (the surface), of the nine moments s and, where the normal comes
/// from a weighted plane, of that plane's theta. boundPatch() gives its state and the
/// Jacobian of that; the paper's parameters follow from the state
/// (patch/state_parameters.h).
#pragma once

#include "patch/state_parameters.h"
#include "placement.h"
#include "surface_fit.h"

namespace holdfast {

/// d[M | k | nu | c] / d joint.
using PatchJacobian = Eigen::Matrix<double,
                                    Eigen::Dynamic,
                                    JointLayout::kSize,
                                    Eigen::RowMajor | Eigen::DontAlign,
                                    kMaxState,
                                    JointLayout::kSize>;

struct BoundedPatch {
  /// Converged, Degenerate (no extent, or no direction for z), CurvatureSignMismatch.
  FitStatus status = FitStatus::Converged;
  PatchState state;
  Patch patch;
  StateAxes axes; ///< the state in the axes of the patch
  PatchJacobian jacobian; ///< of the state in these axes
  double squared_bound = 0.0; ///< squaredBoundPerMoment() of its type
};

/// What is to be bounded, for one call: it refers to what it is made of.
struct BoundRequest {
  PatchType type;
  const UnboundedSurface& surface;
  const Scatter& scatter;
  /// The weighted plane that gives sphere and cylinder their normal; null: the normal
  /// of the scatter.
  const UnboundedSurface* plane;
  Eigen::Vector3d origin; ///< of the batch, world frame
};

/// How it is bounded, the same for every patch.
struct BoundSettings {
  double squared_bound = 0.0; ///< squaredBoundPerMoment() of curved surfaces
  double squared_plane_bound = 0.0; ///< and of planes
  bool smooth_circle_radius = true; ///< see FitOptions
  bool centre_on_normal_line = true; ///< see FitOptions
};

/// Bounds a fitted surface as a patch of the requested type and brings it into
/// canonical form.
BoundedPatch boundPatch(const BoundRequest& request, const BoundSettings& settings);

} // namespace holdfast
