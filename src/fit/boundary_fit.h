/// \file From an unbounded surface to a bounded patch: paper stages II-4 to II-9.
///
/// The bounds are functions of the projected points' moments, so the whole patch is a
/// function of theta (the surface), of the nine moments s and, where the normal comes
/// from a weighted plane, of that plane's theta. boundPatch() gives its value and its
/// Jacobian, as a state and in the paper's parameters.
#pragma once

#include "placement.h"
#include "surface_fit.h"
#include <holdfast/patch/state.h>

namespace holdfast {

/// d[d | k | r | c] / d joint; as many rows as the patch has parameters.
using PatchJacobian = Eigen::Matrix<double,
                                    Eigen::Dynamic,
                                    JointLayout::kSize,
                                    Eigen::RowMajor | Eigen::DontAlign,
                                    kMaxParameters,
                                    JointLayout::kSize>;

/// lambda = sqrt(2) erfinv(Gamma) of stage II-4, and sqrt(-ln(1 - Gamma)) of II-9.
struct ContainmentFactors {
  double lambda = 0.0;
  double plane = 0.0;

  /// \param containment Gamma in (0, 1).
  static ContainmentFactors of(double containment);
};

struct BoundedPatch {
  /// Converged, Degenerate (no extent, or no direction for z), CurvatureSignMismatch.
  FitStatus status = FitStatus::Converged;
  Patch patch;
  PatchJacobian jacobian;
  PatchState state;
  PatchJacobian state_jacobian; ///< d[M | k | nu | c] / d joint
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
  ContainmentFactors factors;
  bool smooth_circle_radius = true; ///< see FitOptions
  bool centre_on_normal_line = true; ///< see FitOptions
};

/// Bounds a fitted surface as a patch of the requested type and brings it into
/// canonical form.
BoundedPatch boundPatch(const BoundRequest& request, const BoundSettings& settings);

} // namespace holdfast
