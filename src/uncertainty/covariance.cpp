#include "covariance.h"

#include "congruence.h"

#include "fit/models/models.h"
#include "geometry/symmetric.h"
#include "parallel/thread_memory.h"

#include "second_order.h"
#include "stagewise.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/uncertainty/monte_carlo.h>

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

// Where the parameters count as linear in the points: the second-order terms of their
// covariance are below kLinear of the first (q3). That is so where the sigma of the
// angle of an axis is below kLinearAngle and the curvature of a cylinder above
// kLinearSigmas; with the second-order terms added, up to the others. `experiment
// consistency --scene sweep` prints what NEES/dof is there.
constexpr double kLinear = 0.03;
constexpr double kLinearAngle = 0.03, kSecondOrderAngle = 0.10; // rad
constexpr double kLinearSigmas = 20.0, kSecondOrderSigmas = 12.0;

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
gain(const ByTheta& F_theta, const ThetaMatrix& inverse)
{
  return -F_theta.lazyProduct(inverse);
}

// Noise sums of the plane stage's gradient, with itself, and with what it shares with
// the surface and the moments. The moments are in the axes of the surface.
struct PlaneStageSums {
  ThetaMatrix own; // sum X_p Sigma X_p^T
  Eigen::Matrix<double, 6, 6> with_surface; // sum X_p Sigma X^T
  Eigen::Matrix<double, 6, 9> with_moments; // sum X_p Sigma D^T
};

// Both stages' gradients by the points, X of n and X_p of np rows, row by row for each
// point and in the axes of each surface.
struct StageGradients {
  const std::vector<double>& X;
  const std::vector<double>& Xp;
  int n, np;

  using Terms = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor, 6, 3>;

  Eigen::Map<const Terms> surface(int i) const
  {
    return {X.data() + 3 * n * i, n, 3};
  }
  Eigen::Map<const Terms> plane(int i) const
  {
    return {Xp.data() + 3 * np * i, np, 3};
  }
};

StageGradients
stageGradients(const PatchFit& fit, const PointBatch& batch, Residual residual)
{
  // Kept between patches: no allocation once they have seen the largest.
  auto& X = threadMemory<std::vector<double>, struct SurfaceTerms>();
  auto& Xp = threadMemory<std::vector<double>, struct PlaneTerms>();
  const kernel::Points points = kernelPoints(batch);
  const auto fill = [&](const UnboundedSurface& surface, std::vector<double>& terms) {
    kernel::crossTerms(surface.model,
                       residual,
                       points,
                       kernelState(surface, fit.scatter),
                       terms);
  };
  fill(fit.surface.surface, X);
  fill(fit.plane.surface, Xp);
  return {X,
          Xp,
          kernel::parameterCount(fit.surface.surface.model),
          kernel::parameterCount(fit.plane.surface.model)};
}

Eigen::Vector3d
sharedDirection(const PointBatch& batch, int i)
{
  return {batch.channel(PointBatch::EX)[i],
          batch.channel(PointBatch::EY)[i],
          batch.channel(PointBatch::EZ)[i]};
}

// The covariance of a point that the sums count: with a pattern, its EXTRA beside it,
// or, without the pattern, what is left of it.
Eigen::Matrix3d
countedCovariance(const PointBatch& batch, int i, bool with_pattern)
{
  Eigen::Matrix3d Sigma = batch.covariance(i);
  if (batch.pattern() == nullptr)
    return Sigma;
  const Eigen::Vector3d r = sharedDirection(batch, i);
  const double along =
      with_pattern ? batch.channel(PointBatch::EXTRA)[i] : -batch.pattern()->variance();
  return Sigma + along * r * r.transpose();
}

// As kernel::PatternPoints::cells, of other responses: all the plane's, and `rows` of
// the surface from the first on.
kernel::CellSums
sumInCells(const PatchFit& fit,
           const PointBatch& batch,
           const StageGradients& terms,
           int first,
           int rows)
{
  const Eigen::Matrix3d &R = fit.surface.surface.R, &Rp = fit.plane.surface.R;
  const double per_count = 1.0 / batch.size();
  kernel::CellSums cells{};
  for (int i = 0; i < batch.size(); ++i) {
    const Eigen::Vector3d direction = sharedDirection(batch, i);
    const Eigen::Vector3d r = R.transpose() * direction;
    const Eigen::Vector3d qt =
        R.transpose() * (batch.point(i) - batch.origin() - fit.scatter.mean);
    Eigen::Map<Eigen::Matrix<double, kPatternTerms, 1>> y(
        cells.y[fit.support.cellOf(batch.channel(PointBatch::U)[i],
                                   batch.channel(PointBatch::V)[i])]);
    y.head(terms.np) += terms.plane(i) * (Rp.transpose() * direction);
    y.segment(terms.np, rows) += terms.surface(i).middleRows(first, rows) * r;
    y.segment<3>(kernel::kMaxTheta) += per_count * r;
    for (int e = 0; e < symmetric::kSize; ++e) {
      const int b = symmetric::kRow[e], c = symmetric::kColumn[e];
      y[kernel::kMaxTheta + 3 + e] += per_count * (qt[b] * r[c] + qt[c] * r[b]);
    }
  }
  return cells;
}

// The pairs of points that share errors. There is room for six rows of responses with
// themselves and with the moments: here the plane's in front, and behind them those of
// the surface, as many as there is room for, in turn.
void
addPatternOfPlaneStage(const PatchFit& fit,
                       const PointBatch& batch,
                       const StageGradients& terms,
                       PlaneStageSums& sums)
{
  const int room = kernel::kMaxTheta - terms.np;
  for (int first = 0; first < terms.n; first += room) {
    const int rows = std::min(room, terms.n - first);
    kernel::CellSums cells = sumInCells(fit, batch, terms, first, rows);
    const PatternMatrix sum =
        fit.support.sum(*batch.pattern(), kernel::Precision::Double, cells);
    sums.with_surface.block(0, first, terms.np, rows) +=
        sum.block(0, terms.np, terms.np, rows);
    if (first == 0)
      sums.with_moments.topRows(terms.np) +=
          sum.block(0, kernel::kMaxTheta, terms.np, 9);
  }
}

// \param with_pattern false: of what errors make that points do not share.
PlaneStageSums
planeStageSums(const PatchFit& fit,
               const PointBatch& batch,
               const FitOptions& options,
               bool with_pattern)
{
  const Eigen::Matrix3d &R = fit.surface.surface.R, &Rp = fit.plane.surface.R;
  const StageGradients terms = stageGradients(fit, batch, options.residual);
  const int n = terms.n, np = terms.np;
  PlaneStageSums sums;
  sums.with_surface.setZero();
  sums.with_moments.setZero();
  for (int i = 0; i < batch.size(); ++i) {
    // To the axes of the surface.
    const StageGradients::Terms noise =
        terms.plane(i) * Rp.transpose() * countedCovariance(batch, i, with_pattern) * R;
    sums.with_surface.topLeftCorner(np, n) += noise * terms.surface(i).transpose();
    const Eigen::Vector3d qt =
        R.transpose() * (batch.point(i) - batch.origin() - fit.scatter.mean);
    sums.with_moments.topLeftCorner(np, 3) += noise;
    for (int b = 0, entry = 3; b < 3; ++b)
      for (int c = b; c < 3; ++c, ++entry)
        sums.with_moments.col(entry).head(np) +=
            noise.col(b) * qt[c] + noise.col(c) * qt[b];
  }
  sums.with_moments /= batch.size();
  const SurfaceFit& plane = fit.plane;
  sums.own = with_pattern || !plane.white ? plane.linearization.XX : plane.white->XX;
  if (with_pattern && batch.pattern() != nullptr) {
    sums.own += plane.linearization.pattern.topLeftCorner<6, 6>();
    addPatternOfPlaneStage(fit, batch, terms, sums);
  }
  return sums;
}

// What the plane stage adds to the covariance.
ParameterMatrix
planeStageCovariance(const PatchFit& fit,
                     const PlaneStageSums& sums,
                     const PatchJacobian& F,
                     const ByTheta& G,
                     const ByMoments& M,
                     CovarianceMode mode)
{
  ByTheta F_plane = ByTheta::Zero(G.rows(), 6);
  F_plane.leftCols<3>() = F.middleCols<3>(JointLayout::kPlane);
  const ByTheta Gp = gain(F_plane, symmetricInverse(hessianOf(fit.plane, mode)));
  const ByTheta own = Gp.lazyProduct(sums.own);
  const ByTheta with_surface = Gp.lazyProduct(sums.with_surface);
  const ByMoments with_moments = Gp.lazyProduct(sums.with_moments);
  ParameterMatrix result = own.lazyProduct(Gp.transpose());
  result += 2.0 * with_surface.lazyProduct(G.transpose());
  result += 2.0 * with_moments.lazyProduct(M.transpose());
  return symmetrized(result);
}

// Covariance of what moves the estimate: X_i dq_i, then the moments (JointLayout).
SmallRows
noiseOf(const Linearization& l)
{
  constexpr int kTheta = kernel::kMaxTheta;
  SmallRows C(kPatternTerms);
  for (int j = 0; j < kTheta; ++j)
    for (int i = 0; i < kTheta; ++i)
      C(i, j) = l.XX(i, j);
  for (int j = 0; j < kMoments; ++j) {
    for (int i = 0; i < kTheta; ++i)
      C(i, kTheta + j) = C(kTheta + j, i) = l.XD(i, j);
    for (int i = 0; i < kMoments; ++i)
      C(kTheta + i, kTheta + j) = l.DD(i, j);
  }
  // What errors that points share add; symmetric, so that both go along what is stored.
  for (int i = 0; l.has_pattern && i < kPatternTerms; ++i)
    for (int j = 0; j < kPatternTerms; ++j)
      C(i, j) += l.pattern(j, i);
  return C;
}

struct FirstOrder {
  ParameterMatrix covariance;
  double cancellation = 1.0; ///< as PatchCovariance::cancellation
};

// Largest ratio of the variances that the errors alone would make of C to those of the
// result of J C J^T.
double
cancellationIn(const SmallRows& J, const SmallRows& C, const ParameterMatrix& result)
{
  double largest = 1.0;
  for (int i = 0; i < result.rows(); ++i) {
    double terms = 0.0;
    for (int k = 0; k < kPatternTerms; ++k)
      terms += J(i, k) * J(i, k) * C(k, k);
    largest = std::max(largest, terms / std::abs(result(i, i)));
  }
  return largest;
}

// Of what has the Jacobian F to the joint variables.
// \param inverse of the Hessian
// \param l of fit.surface, with all errors or some of them
FirstOrder
firstOrderCovariance(const PatchJacobian& F,
                     const ThetaMatrix& inverse,
                     const Linearization& l,
                     const PatchFit& fit,
                     const PointBatch& batch,
                     const FitOptions& options,
                     CovarianceMode mode)
{
  // d(estimate)/dq_i = G X_i + M D_i. lazyProduct: for matrices this small Eigen's
  // blocked product costs several times the work.
  const ByTheta G = gain(F.middleCols<6>(JointLayout::kTheta), inverse);
  const ByMoments M = F.middleCols<9>(JointLayout::kMean) + G.lazyProduct(l.A);
  const int n = static_cast<int>(G.rows());
  SmallRows J(n);
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 6; ++k)
      J(i, k) = G(i, k);
    for (int k = 0; k < 9; ++k)
      J(i, 6 + k) = M(i, k);
  }
  const SmallRows C = noiseOf(l);
  FirstOrder result;
  result.covariance = J.congruence<ParameterMatrix>(C);
  if (l.has_pattern)
    result.cancellation = cancellationIn(J, C, result.covariance);
  if (fit.has_plane_stage)
    result.covariance +=
        planeStageCovariance(fit,
                             planeStageSums(fit, batch, options, l.has_pattern),
                             F,
                             G,
                             M,
                             mode);
  result.covariance = symmetrized(result.covariance);
  return result;
}

template <typename Jacobian>
ParameterMatrix
propagated(const Jacobian& J, const ParameterMatrix& S)
{
  return SmallRows(J).congruence<ParameterMatrix>(SmallRows(S));
}

// Covariance of the joint variables (JointLayout).
JointMatrix
jointCovariance(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
{
  const Linearization& l = fit.surface.linearization;
  const ThetaMatrix inverse = symmetricInverse(l.H);
  JointMatrix joint = JointMatrix::Zero();
  joint.topLeftCorner<6, 6>() = thetaCovariance(l, l.H);
  const ThetaByMoments gradient = l.XD + l.A.lazyProduct(l.DD);
  joint.block<6, 9>(0, JointLayout::kMean) = -inverse.lazyProduct(gradient);
  joint.block<9, 9>(JointLayout::kMean, JointLayout::kMean) = l.DD;
  if (l.has_pattern) {
    const auto with_moments = l.pattern.topRightCorner<6, 9>();
    const auto moments = l.pattern.bottomRightCorner<9, 9>();
    const ThetaByMoments shared = with_moments + l.A.lazyProduct(moments);
    joint.block<6, 9>(0, JointLayout::kMean) -= inverse.lazyProduct(shared);
    joint.block<9, 9>(JointLayout::kMean, JointLayout::kMean) += moments;
  }
  if (fit.has_plane_stage) {
    const Linearization& p = fit.plane.linearization;
    const PlaneStageSums sums = planeStageSums(fit, batch, options, l.has_pattern);
    const ThetaMatrix plane = symmetricInverse(p.H);
    const ThetaMatrix own = plane * sums.own * plane;
    const ThetaMatrix gradients =
        sums.with_surface.transpose() + l.A.lazyProduct(sums.with_moments.transpose());
    const ThetaMatrix with_theta = inverse * gradients * plane;
    joint.block<3, 3>(JointLayout::kPlane, JointLayout::kPlane) =
        own.topLeftCorner<3, 3>();
    joint.block<6, 3>(0, JointLayout::kPlane) = with_theta.leftCols<3>();
    joint.block<9, 3>(JointLayout::kMean, JointLayout::kPlane) =
        -plane.lazyProduct(sums.with_moments).transpose().leftCols<3>();
  }
  joint.triangularView<Eigen::StrictlyLower>() = joint.transpose();
  // Padding of theta has no variance.
  const int n = kernel::parameterCount(fit.surface.surface.model);
  joint.block(n, n, 6 - n, 6 - n).setZero();
  return joint;
}

// Standard deviation of the normal's direction, radians.
double
tiltSigma(PatchType type, const StateMatrix& covariance)
{
  const int nu = stateLayoutOf(type).nu();
  return std::sqrt(covariance(nu, nu) + covariance(nu + 1, nu + 1));
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
isPositiveSemiDefiniteByPivots(const StateMatrix& S)
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
    const double inverse = 1.0 / std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      double entry = S(i, j) * scale[i] * scale[j];
      for (int k = 0; k < j; ++k)
        entry -= L[i][k] * L[j][k];
      L[i][j] = entry * inverse;
    }
  }
  return true;
}

// |kappa| in its sigmas where the surface closes around a centre or an axis, which are
// 1/kappa away; else as large as can be.
double
curvatureInSigmas(const Patch& patch, const ParameterMatrix& covariance)
{
  if (!wraps(modelOf(patch.type.surface)))
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

// True when r_xy of a revolute type is so near the end of its chart, |r_xy| = pi, that
// it bends within the normal's error.
bool
isAtEndOfChart(const Patch& patch, double tilt_sigma)
{
  constexpr double kFarInSigmas = 10.0;
  return isRevolute(patch.type) && kPi - patch.r.norm() < kFarInSigmas * tilt_sigma;
}

// q3 from what makes it: the square of an axis' sigma in radians, of the inverse of a
// curvature in sigmas. At 0.03 rad and at 20 sigmas it is kLinear.
double
proxyOfNonlinearity(double axis_sigma, double curvature_in_sigmas)
{
  const double axis = axis_sigma / kLinearAngle;
  const double curvature = kLinearSigmas / curvature_in_sigmas;
  return kLinear * std::max(axis * axis, curvature * curvature);
}

} // namespace

double
expectedChi2(const PatchFit& fit)
{
  const SurfaceFit& surface = fit.surface;
  return fit.points - (surface.linearization.has_pattern ?
                           surface.taken_up :
                           kernel::parameterCount(surface.surface.model));
}

FitStatus
statusOf(const Patch& patch, const PatchCovariance& uncertainty)
{
  if (uncertainty.state.size() == 0 || !uncertainty.state.allFinite())
    return FitStatus::NonFinite;
  const PatchType type = patch.type;
  const bool has_axis = type.surface == SurfaceType::CircularCylinder;
  // No covariance: its terms have cancelled down to rounding.
  const bool is_degenerate =
      !isPositiveSemiDefiniteByPivots(uncertainty.state) ||
      !isPositiveSemiDefiniteByPivots(uncertainty.parameters) ||
      (has_axis &&
       !(curvatureInSigmas(patch, uncertainty.parameters) >= kNoCurvatureSigmas)) ||
      tiltSigma(type, uncertainty.state) > kUndeterminedTilt;
  return is_degenerate ? FitStatus::Degenerate : FitStatus::Converged;
}

Linearity
linearityOf(const Patch& patch, const PatchCovariance& uncertainty)
{
  const ParameterMatrix& S = uncertainty.parameters;
  const double axis = axisSigma(patch, S), curvature = curvatureInSigmas(patch, S);
  const bool round = patch.type.surface == SurfaceType::Sphere;
  const bool second = uncertainty.shift.size() > 0;
  Linearity linearity;
  FitFlags& flags = linearity.flags;
  const double largest_angle = second ? kSecondOrderAngle : kLinearAngle;
  flags.axis_not_observable = !(axis <= largest_angle);
  // The centre of a sphere's patch does not rest on 1/kappa, unless it is the apex.
  const double least_sigmas = round  ? kUnobservableSigmas :
                              second ? kSecondOrderSigmas :
                                       kLinearSigmas;
  flags.curvature_not_observable = !(curvature >= least_sigmas);
  flags.orientation_singular =
      isAtEndOfChart(patch, tiltSigma(patch.type, uncertainty.state));
  linearity.nonlinearity =
      second ? uncertainty.nonlinearity :
               proxyOfNonlinearity(axis,
                                   round ? std::numeric_limits<double>::infinity() :
                                           curvature);
  return linearity;
}

Linearity
linearityOf(const PatchFit& fit, const PatchCovariance& uncertainty)
{
  Linearity linearity = linearityOf(fit.bounded.patch, uncertainty);
  if (isCentreBeyondReach(fit))
    linearity.flags.curvature_not_observable = true;
  return linearity;
}

namespace {

// Resample and refit.
PatchCovariance
monteCarlo(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
{
  // One thread: callers are parallel over patches.
  MonteCarloOptions monte_carlo;
  monte_carlo.threads = 1;
  const MonteCarloResult drawn =
      monteCarloCovariance(fit.bounded.patch, batch, options, monte_carlo);
  PatchCovariance result;
  result.state = drawn.state_covariance;
  result.parameters = drawn.covariance;
  return result;
}

// True where the parameters are linear enough for second order to hold, but not for
// first order alone.
bool
asksForSecondOrder(const PatchFit& fit, const PatchCovariance& exact)
{
  const Patch& patch = fit.bounded.patch;
  const double axis = axisSigma(patch, exact.parameters);
  const double curvature = patch.type.surface == SurfaceType::Sphere ?
                               std::numeric_limits<double>::infinity() :
                               curvatureInSigmas(patch, exact.parameters);
  const bool first = axis <= kLinearAngle && curvature >= kLinearSigmas;
  return !first && axis <= kSecondOrderAngle && curvature >= kSecondOrderSigmas;
}

// tr(A^-1 B), A of unit diagonal. Where A is singular, B is with it, and both are what
// rows that determine the others make them: eliminated from both by the largest pivots.
double
traceOfRatio(ParameterMatrix A, ParameterMatrix B)
{
  constexpr double kNull = 1e-12;
  const int n = static_cast<int>(A.rows());
  bool is_left[kMaxParameters];
  std::fill_n(is_left, n, true);
  double trace = 0.0;
  for (int step = 0; step < n; ++step) {
    int p = -1;
    for (int i = 0; i < n; ++i)
      if (is_left[i] && A(i, i) > (p < 0 ? kNull : A(p, p)))
        p = i;
    if (p < 0)
      break;
    is_left[p] = false;
    trace += B(p, p) / A(p, p);
    const ParameterVector share = A.col(p) / A(p, p), b = B.col(p);
    for (int i = 0; i < n; ++i)
      for (int j = 0; is_left[i] && j < n; ++j) {
        A(i, j) -= share[i] * share[j] * A(p, p);
        B(i, j) -= share[i] * b[j] + b[i] * share[j] - share[i] * share[j] * b[p];
      }
  }
  return trace;
}

void
addSecondOrder(const PatchFit& fit,
               const PointBatch& batch,
               const PatchFitter& fitter,
               PatchCovariance& result)
{
  const SecondOrderTerms terms =
      secondOrderTerms(fit,
                       fitter,
                       batch.origin(),
                       jointCovariance(fit, batch, fitter.options()));
  const Eigen::VectorXd scale = result.parameters.diagonal().cwiseSqrt().cwiseInverse();
  const ParameterMatrix first =
      scale.asDiagonal() * result.parameters * scale.asDiagonal();
  const ParameterMatrix second =
      scale.asDiagonal() * terms.covariance * scale.asDiagonal();
  result.nonlinearity = traceOfRatio(first, second) / static_cast<double>(scale.size());
  result.parameters += terms.covariance;
  result.shift = terms.shift;
  result.state += terms.state_covariance;
  result.state_shift = terms.state_shift;
}

} // namespace

PatchCovariance
patchCovariance(const PatchFit& fit,
                const PointBatch& batch,
                const PatchFitter& fitter,
                CovarianceMode mode)
{
  PatchCovariance result;
  if (fit.status != FitStatus::Converged)
    return result;
  const FitOptions& options = fitter.options();
  if (mode == CovarianceMode::MonteCarlo)
    return monteCarlo(fit, batch, options);
  const ThetaMatrix inverse = symmetricInverse(hessianOf(fit.surface, mode));
  const BoundedPatch& bounded = fit.bounded;
  const auto inAxes = [&](const Linearization& l) {
    return firstOrderCovariance(bounded.jacobian,
                                inverse,
                                l,
                                fit,
                                batch,
                                options,
                                mode);
  };
  const FirstOrder first = inAxes(fit.surface.linearization);
  const StateMatrix& S = first.covariance;
  const StateMatrix turn = stateByAxes(bounded.axes);
  result.cancellation = first.cancellation;
  result.state = propagated(turn, S);
  if (fit.surface.white)
    result.white_state = propagated(turn, inAxes(*fit.surface.white).covariance);
  result.parameters =
      mode == CovarianceMode::Stagewise ?
          stagewiseCovariance(fit, batch, options) :
          propagated(parametersByAxes(bounded.axes, bounded.squared_bound), S);
  if (mode == CovarianceMode::SecondOrder ||
      (mode == CovarianceMode::Auto && asksForSecondOrder(fit, result)))
    addSecondOrder(fit, batch, fitter, result);
  return result;
}

} // namespace holdfast
