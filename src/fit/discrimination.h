/// \file Stage I-3: which paraboloid the data show.
#pragma once

#include <holdfast/fit/options.h>
#include <holdfast/patch/types.h>

#include <Eigen/Core>

namespace holdfast {

/// Thresholds of the chi-square tests at one level, for 3, 2 and 1 degrees of freedom.
struct DiscriminationThresholds {
  double plane = 0.0;
  double circular = 0.0;
  double cylindric = 0.0;

  /// \param level probability of rejecting the simpler type when it is true, in (0, 1).
  static DiscriminationThresholds atLevel(double level);
};

/// Type of a paraboloid from its curvatures k = (kxx, kxy, kyy) and their covariance C.
///
/// Plane: T = k^T C^-1 k. Circular: T = (Mk)^T (M C M^T)^-1 (Mk), M = [1 0 -1; 0 2 0].
/// Cylindric: T = kappa^2 / sigma^2 of the smaller principal curvature. Each is
/// accepted below its threshold, or where the quantity itself is below the curvature
/// tolerance; when both circular and cylindric are, the smaller ratio to the threshold
/// wins. Without statistical_discrimination: the paper's fixed threshold (I-3; the
/// heading's "s != parab" is a misprint for "s = parab").
SurfaceType discriminate(const Eigen::Vector3d& k,
                         const Eigen::Matrix3d& C,
                         const DiscriminationThresholds& thresholds,
                         const FitOptions& options);

} // namespace holdfast
