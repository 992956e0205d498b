#include "covariance.h"

#include "second_order.h"
#include "stagewise.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast {
namespace {

using kernel::Model;
using ByTheta =
    Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMaxParameters, 6>;
using ByMoments =
    Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor, kMaxParameters, 9>;
using JointMatrix = Eigen::Matrix<double, JointLayout::kSize, JointLayout::kSize>;

// An axis whose angle is uncertain by this many radians is not observable: three sigmas
// reach half-way to the next symmetric axis, pi/4, and first order means nothing there.
constexpr double kUnobservableAngle = 0.25;

// A normal that is uncertain by this many radians might point anywhere.
constexpr double kUndeterminedTilt = 1.0;

// |kappa| below this many of its sigmas cannot be told from zero, and 1/kappa, on which
// the centre of a sphere or cylinder rests, has no first-order distribution.
constexpr double kUnobservableSigmas = 3.0;

// Below this many it is none: the terms of the centre's covariance grow with 1/kappa^2
// and cancel, down to rounding.
constexpr double kNoCurvatureSigmas = 0.1;

// Where the radius is this many times the spread of the points, they rise by less than
// a hundredth of it over the surface's tangent plane: whatever the noise says, it is
// what the surface is not that decides, and the centre, which lies on the normal of the
// scatter, moves with the normal's error times as much.
constexpr double kLargestRadiusInSpreads = 50.0;

const ThetaMatrix&
hessianOf(const SurfaceFit& fit, CovarianceMode mode)
{
  return mode == CovarianceMode::GaussNewton ? fit.JtJ : fit.linearization.H;
}

// -F_theta H^-1.
ByTheta
gain(const ByTheta& F_theta, const ThetaMatrix& H)
{
  return -F_theta.lazyProduct(symmetricInverse(H));
}

// Noise sums that the plane stage shares with the surface and the moments. The moments
// are in the axes of the surface.
struct PlaneStageSums {
  Eigen::Matrix<double, 6, 6> with_surface; // sum X_p Sigma X^T
  Eigen::Matrix<double, 6, 9> with_moments; // sum X_p Sigma D^T
};

PlaneStageSums
planeStageSums(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
{
  const UnboundedSurface& surface = fit.surface.surface;
  const UnboundedSurface& plane = fit.plane.surface;
  const kernel::Points points = kernelPoints(batch);
  // Kept between patches: no allocation once they have seen the largest.
  thread_local std::vector<double> X, Xp;
  kernel::crossTerms(surface.model,
                     options.residual,
                     points,
                     kernelState(surface, fit.scatter),
                     X);
  kernel::crossTerms(plane.model,
                     options.residual,
                     points,
                     kernelState(plane, fit.scatter),
                     Xp);
  const int n = kernel::parameterCount(surface.model);
  const int np = kernel::parameterCount(plane.model);
  using Terms = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor, 6, 3>;
  PlaneStageSums sums;
  sums.with_surface.setZero();
  sums.with_moments.setZero();
  for (int i = 0; i < batch.size(); ++i) {
    const Eigen::Map<const Terms> Xi(X.data() + 3 * n * i, n, 3);
    const Eigen::Map<const Terms> Xpi(Xp.data() + 3 * np * i, np, 3);
    // To the axes of the surface.
    const Terms noise = Xpi * plane.R.transpose() * batch.covariance(i) * surface.R;
    sums.with_surface.topLeftCorner(np, n) += noise * Xi.transpose();
    const Eigen::Vector3d qt =
        surface.R.transpose() * (batch.point(i) - batch.origin() - fit.scatter.mean);
    sums.with_moments.topLeftCorner(np, 3) += noise;
    for (int b = 0, entry = 3; b < 3; ++b)
      for (int c = b; c < 3; ++c, ++entry)
        sums.with_moments.col(entry).head(np) +=
            noise.col(b) * qt[c] + noise.col(c) * qt[b];
  }
  sums.with_moments /= batch.size();
  return sums;
}

// What the plane stage adds to the covariance.
ParameterMatrix
planeStageTerms(const PatchFit& fit,
                const PointBatch& batch,
                const FitOptions& options,
                const ByTheta& G,
                const ByMoments& M,
                CovarianceMode mode)
{
  const PlaneStageSums sums = planeStageSums(fit, batch, options);
  ByTheta F_plane = ByTheta::Zero(G.rows(), 6);
  F_plane.leftCols<3>() = fit.bounded.jacobian.middleCols<3>(JointLayout::kPlane);
  const ByTheta Gp = gain(F_plane, hessianOf(fit.plane, mode));
  const ParameterMatrix cross =
      Gp * (sums.with_surface * G.transpose() + sums.with_moments * M.transpose());
  return symmetrized(
      ParameterMatrix(Gp * fit.plane.linearization.XX * Gp.transpose() + 2.0 * cross));
}

// What errors that points share add to the covariance.
ParameterMatrix
patternTerms(const PatternMatrix& pattern, const ByTheta& G, const ByMoments& M)
{
  Eigen::Matrix<double,
                Eigen::Dynamic,
                kPatternTerms,
                Eigen::RowMajor,
                kMaxParameters,
                kPatternTerms>
      J(G.rows(), kPatternTerms);
  J << G, M;
  return J.lazyProduct(pattern).eval().lazyProduct(J.transpose());
}

ParameterMatrix
firstOrderCovariance(const PatchFit& fit,
                     const PointBatch& batch,
                     const FitOptions& options,
                     CovarianceMode mode)
{
  const PatchJacobian& F = fit.bounded.jacobian;
  const Linearization& l = fit.surface.linearization;
  // d(estimate)/dq_i = G X_i + M D_i. lazyProduct: for matrices this small Eigen's
  // blocked product costs several times the work.
  const ByTheta G =
      gain(F.middleCols<6>(JointLayout::kTheta), hessianOf(fit.surface, mode));
  const ByMoments M = F.middleCols<9>(JointLayout::kMean) + G.lazyProduct(l.A);
  const ByTheta with_theta =
      G.lazyProduct(l.XX) + 2.0 * M.lazyProduct(l.XD.transpose());
  const ByMoments with_moments = M.lazyProduct(l.DD);
  ParameterMatrix covariance =
      with_theta.lazyProduct(G.transpose()) + with_moments.lazyProduct(M.transpose());
  if (l.has_pattern)
    covariance += patternTerms(l.pattern, G, M);
  if (fit.has_plane_stage)
    covariance += planeStageTerms(fit, batch, options, G, M, mode);
  return symmetrized(covariance);
}

// Covariance of the joint variables (JointLayout).
JointMatrix
jointCovariance(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
{
  const Linearization& l = fit.surface.linearization;
  const ThetaMatrix inverse = l.H.llt().solve(ThetaMatrix(ThetaMatrix::Identity()));
  JointMatrix joint = JointMatrix::Zero();
  joint.topLeftCorner<6, 6>() = thetaCovariance(l, l.H);
  joint.block<6, 9>(0, JointLayout::kMean) = -inverse * (l.XD + l.A * l.DD);
  joint.block<9, 9>(JointLayout::kMean, JointLayout::kMean) = l.DD;
  if (l.has_pattern) {
    const auto with_moments = l.pattern.topRightCorner<6, 9>();
    const auto moments = l.pattern.bottomRightCorner<9, 9>();
    joint.block<6, 9>(0, JointLayout::kMean) -=
        inverse * (with_moments + l.A * moments);
    joint.block<9, 9>(JointLayout::kMean, JointLayout::kMean) += moments;
  }
  if (fit.has_plane_stage) {
    const Linearization& p = fit.plane.linearization;
    const PlaneStageSums sums = planeStageSums(fit, batch, options);
    const ThetaMatrix plane = p.H.llt().solve(ThetaMatrix(ThetaMatrix::Identity()));
    const ThetaMatrix own = plane * p.XX * plane;
    const ThetaMatrix with_theta =
        inverse *
        (sums.with_surface.transpose() + l.A * sums.with_moments.transpose()) * plane;
    joint.block<3, 3>(JointLayout::kPlane, JointLayout::kPlane) =
        own.topLeftCorner<3, 3>();
    joint.block<6, 3>(0, JointLayout::kPlane) = with_theta.leftCols<3>();
    joint.block<9, 3>(JointLayout::kMean, JointLayout::kPlane) =
        -(plane * sums.with_moments).transpose().leftCols<3>();
  }
  joint.triangularView<Eigen::StrictlyLower>() = joint.transpose();
  // Padding of theta has no variance.
  const int n = kernel::parameterCount(fit.surface.surface.model);
  joint.block(n, n, 6 - n, 6 - n).setZero();
  return joint;
}

// Standard deviation of the normal's direction, radians.
double
tiltSigma(const Patch& patch, const ParameterMatrix& covariance)
{
  const ParameterLayout layout = layoutOf(patch.type);
  const Eigen::Matrix3d J = rightJacobian(patch.r);
  const auto rows = J.topLeftCorner(2, layout.r_count);
  const auto S =
      covariance.block(layout.r(), layout.r(), layout.r_count, layout.r_count);
  return std::sqrt(std::max(0.0, rows.lazyProduct(S).cwiseProduct(rows).sum()));
}

// Standard deviation of the rotation about the patch's normal; 0 for revolute types.
double
axisSigma(const Patch& patch, const ParameterMatrix& covariance)
{
  if (isRevolute(patch.type))
    return 0.0;
  const int r = layoutOf(patch.type).r();
  const Eigen::Vector3d row = rightJacobian(patch.r).row(2);
  const Eigen::Matrix3d S = covariance.block<3, 3>(r, r);
  return std::sqrt(std::max(0.0, row.dot(S * row)));
}

// True when the correlations have no eigenvalue below -1e-6, by the Cholesky pivots of
// correlations + 1e-6 I. Written out, since it is asked of every patch. A parameter
// without variance must have no covariance.
bool
isPositiveSemiDefiniteByPivots(const ParameterMatrix& S)
{
  constexpr double kTolerance = 1e-6;
  const int n = static_cast<int>(S.rows());
  double scale[kMaxParameters], L[kMaxParameters][kMaxParameters];
  for (int i = 0; i < n; ++i) {
    const double variance = S(i, i);
    if (!(variance >= 0.0))
      return false;
    if (variance == 0.0 && S.col(i).cwiseAbs().maxCoeff() > 0.0)
      return false;
    scale[i] = variance > 0.0 ? 1.0 / std::sqrt(variance) : 0.0;
  }
  for (int j = 0; j < n; ++j) {
    double pivot = 1.0 + kTolerance;
    for (int k = 0; k < j; ++k)
      pivot -= L[j][k] * L[j][k];
    if (!(pivot > 0.0))
      return false;
    L[j][j] = std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      double entry = S(i, j) * scale[i] * scale[j];
      for (int k = 0; k < j; ++k)
        entry -= L[i][k] * L[j][k];
      L[i][j] = entry / L[j][j];
    }
  }
  return true;
}

// |kappa| in its sigmas, where the centre rests on 1/kappa; else as large as can be.
double
curvatureInSigmas(const Patch& patch, const ParameterMatrix& covariance)
{
  if (patch.type.surface != SurfaceType::Sphere &&
      patch.type.surface != SurfaceType::CircularCylinder)
    return std::numeric_limits<double>::infinity();
  const int k = layoutOf(patch.type).k();
  return std::abs(patch.kappa[0]) / std::sqrt(covariance(k, k));
}

// True when the centre of a sphere or cylinder is too far away for the points to tell.
bool
isCentreBeyondReach(const PatchFit& fit)
{
  const Patch& patch = fit.bounded.patch;
  const bool cylinder = patch.type.surface == SurfaceType::CircularCylinder;
  if (!cylinder && patch.type.surface != SurfaceType::Sphere)
    return false;
  const Eigen::Matrix3d& C = fit.scatter.covariance;
  double variance = C.trace();
  if (cylinder) {
    const Eigen::Vector3d axis = patch.pose().R.col(0);
    variance -= axis.dot(C * axis);
  }
  const double spread = std::sqrt(std::max(variance, 0.0));
  return std::abs(patch.kappa[0]) * kLargestRadiusInSpreads * spread < 1.0;
}

} // namespace

double
expectedChi2(const PatchFit& fit)
{
  const SurfaceFit& surface = fit.surface;
  const Linearization& l = surface.linearization;
  const int p = kernel::parameterCount(surface.surface.model);
  if (!l.has_pattern)
    return fit.points - p;
  const ThetaMatrix gradient = l.XX + l.pattern.topLeftCorner<6, 6>();
  return fit.points - symmetricInverse(l.H).cwiseProduct(gradient).sum();
}

FitStatus
observability(const PatchFit& fit, const ParameterMatrix& covariance)
{
  const Patch& patch = fit.bounded.patch;
  if (covariance.size() == 0 || !covariance.allFinite())
    return FitStatus::NonFinite;
  const double curvature = curvatureInSigmas(patch, covariance);
  // No covariance: its terms have cancelled down to rounding.
  if (!isPositiveSemiDefiniteByPivots(covariance) ||
      !(curvature >= kNoCurvatureSigmas) ||
      tiltSigma(patch, covariance) > kUndeterminedTilt)
    return FitStatus::Degenerate;
  if (curvature < kUnobservableSigmas || isCentreBeyondReach(fit))
    return FitStatus::CurvatureNotObservable;
  if (axisSigma(patch, covariance) > kUnobservableAngle)
    return FitStatus::AxisNotObservable;
  return FitStatus::Converged;
}

PatchCovariance
patchCovariance(const PatchFit& fit,
                const PointBatch& batch,
                const PatchFitter& fitter,
                CovarianceMode mode)
{
  PatchCovariance result;
  if (fit.status != FitStatus::Converged)
    return result;
  if (mode == CovarianceMode::Stagewise) {
    result.covariance = stagewiseCovariance(fit, batch, fitter.options());
    return result;
  }
  if (mode == CovarianceMode::MonteCarlo) {
    // One thread: callers are parallel over patches.
    MonteCarloOptions monte_carlo;
    monte_carlo.threads = 1;
    result.covariance =
        monteCarloCovariance(fit.bounded.patch, batch, fitter.options(), monte_carlo)
            .covariance;
    return result;
  }
  result.covariance = firstOrderCovariance(fit, batch, fitter.options(), mode);
  if (mode == CovarianceMode::SecondOrder) {
    const SecondOrderTerms terms =
        secondOrderTerms(fit,
                         fitter,
                         batch.origin(),
                         jointCovariance(fit, batch, fitter.options()));
    result.covariance += terms.covariance;
    result.mean_shift = terms.shift;
  }
  return result;
}

} // namespace holdfast
