/// \file The weighted paraboloid fit as one would write it with Ceres.
#pragma once

#ifdef HOLDFAST_HAVE_CERES

#include <holdfast/fit/point_batch.h>

#include <Eigen/Core>

namespace holdfast::benchmarks {

struct CeresFit {
  /// [kxx kxy kyy delta_x delta_y a] in the frame of the principal axes.
  Eigen::Matrix<double, 6, 1> parameters = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  bool converged = false;
};

/// Fits f / sqrt(g Sigma g^T) with automatic derivatives and computes the covariance of
/// the six parameters (no boundary, no centroid noise).
CeresFit fitWithCeres(const PointBatch& batch);

} // namespace holdfast::benchmarks

#endif
