/// \file Unbounded surfaces: paper stages I-1 and I-2.
#pragma once

#include "pattern.h"
#include "unbounded_surface.h"
#include <holdfast/fit/point_batch.h>
#include <holdfast/fit/result.h>

#include <Eigen/Core>

#include <optional>

namespace holdfast {

/// The moments s of the points: mean (3), then scatter xx xy xz yy yz zz (6).
inline constexpr int kMoments = 9;
using ThetaByMoments =
    Eigen::Matrix<double, kernel::kMaxTheta, kMoments, Eigen::DontAlign>;
using MomentMatrix = Eigen::Matrix<double, kMoments, kMoments, Eigen::DontAlign>;

/// How the estimate moves with the points, to first order, in the axes of the fit's
/// frame: with X_i = d^2E/dtheta dq_i, A = d^2E/dtheta ds and D_i = ds/dq_i,
///
///     dtheta/dq_i = -H^-1 (X_i + A D_i).
struct Linearization {
  ThetaMatrix H = ThetaMatrix::Identity(); ///< Hessian; identity on padding
  ThetaByMoments A = ThetaByMoments::Zero();
  ThetaMatrix XX = ThetaMatrix::Zero(); ///< sum X_i Sigma_i X_i^T
  ThetaByMoments XD = ThetaByMoments::Zero(); ///< sum X_i Sigma_i D_i^T
  MomentMatrix DD = MomentMatrix::Zero(); ///< sum D_i Sigma_i D_i^T
  /// What errors that points share add to XX, XD and DD as one matrix (fit/pattern.h).
  bool has_pattern = false;
  PatternMatrix pattern; ///< meaningful when has_pattern
};

/// A fitted surface and what its covariance needs.
struct SurfaceFit {
  FitStatus status = FitStatus::TooFewPoints;
  UnboundedSurface surface;
  double cost = 0.0; ///< half of chi-square
  int iterations = 0;
  int polish_steps = 0;
  ThetaMatrix JtJ = ThetaMatrix::Identity(); ///< Gauss-Newton part of the Hessian
  double smallest_pivot = 0.0; ///< of the Hessian scaled to unit diagonal
  kernel::Precision precision = kernel::Precision::Double; ///< of the sums
  Linearization linearization;
  /// The same with the errors alone that points do not share; when asked for.
  std::optional<Linearization> white;
  /// Where points share errors: how much of chi2 the surface takes up on average.
  double taken_up = 0.0;
  /// Undetermined directions of theta; no column unless Degenerate.
  NullSpace null_space = NullSpace(6, 0);
};

/// Moments and principal axes of a padded batch.
/// \param viewpoint relative to the batch's origin.
Scatter measureScatter(const PointBatch& batch,
                       bool debias,
                       const Eigen::Vector3d& viewpoint);

/// The scatter with other moments; its axes follow, the normal on the same side.
Scatter withMoments(const Scatter& scatter,
                    const Eigen::Vector3d& mean,
                    const Eigen::Matrix3d& covariance);

/// sum X_i, the rows of the first n parameters; zero on padding.
Eigen::Matrix<double, kernel::kMaxTheta, 3> crossSumMatrix(
    const kernel::CovarianceSums& sums,
    int n);

/// The surface moved by a step of theta.
UnboundedSurface retractedSurface(const UnboundedSurface& surface,
                                  const Scatter& scatter,
                                  const Theta& step);

/// P of dn = P dC n, the first-order change of the eigenvector n of the smallest
/// eigenvalue of C (any axes; n unit): P = B (l0 I - B^T C B)^-1 B^T, B normal to n.
Eigen::Matrix3d normalDerivative(const Eigen::Matrix3d& C, const Eigen::Vector3d& n);

/// dn/d(xx xy xz yy yz zz), 3x6.
Eigen::Matrix<double, 3, 6> normalJacobian(const Eigen::Matrix3d& C,
                                           const Eigen::Vector3d& n);

/// Weighted fit of one surface: closed-form start, Levenberg-Marquardt, exact Newton
/// steps at the end, and the linearization there.
/// \param support of the batch; used where it has a pattern.
/// \param coarsest precision that will do.
SurfaceFit fitSurface(kernel::Model model,
                      const PointBatch& batch,
                      const Scatter& scatter,
                      const PatternSupport& support,
                      const FitOptions& options,
                      kernel::Precision coarsest = kernel::Precision::Single);

/// Inverse of a positive definite matrix.
ThetaMatrix symmetricInverse(const ThetaMatrix& H);

/// First-order covariance of theta, from the Hessian or its Gauss-Newton part.
ThetaMatrix thetaCovariance(const Linearization& linearization,
                            const ThetaMatrix& hessian);

/// The batch as the kernel sees it.
kernel::Points kernelPoints(const PointBatch& batch);

/// What its points share errors by, without cells.
kernel::PatternPoints kernelPattern(const PointBatch& batch);

/// The surface as the kernel sees it.
kernel::State kernelState(const UnboundedSurface& surface, const Scatter& scatter);

} // namespace holdfast
