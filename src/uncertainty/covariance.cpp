#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/uncertainty/covariance.h>

#include <Eigen/Cholesky>

#include <cmath>

namespace holdfast {
namespace {

using kernel::Model;
using ByTheta =
    Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMaxParameters, 6>;
using ByMoments =
    Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor, kMaxParameters, 9>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;

// An axis whose angle is uncertain by this many radians is not observable: three sigmas
// reach half-way to the next symmetric axis, pi/4, and first order means nothing there.
constexpr double kUnobservableAngle = 0.25;

// |kappa| below this many of its sigmas cannot be told from zero, and 1/kappa, on which
// the centre of a sphere or cylinder rests, has no first-order distribution.
constexpr double kUnobservableSigmas = 3.0;

const ThetaMatrix&
hessianOf(const SurfaceFit& fit, CovarianceMode mode)
{
  return mode == CovarianceMode::GaussNewton ? fit.JtJ : fit.linearization.H;
}

// -F_theta H^-1.
ByTheta
gain(const ByTheta& F_theta, const ThetaMatrix& H)
{
  const ThetaMatrix inverse = H.llt().solve(ThetaMatrix(ThetaMatrix::Identity()));
  return -F_theta.lazyProduct(inverse);
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
  std::vector<double> X, Xp;
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

bool
curvatureObservable(const Patch& patch, const ParameterMatrix& covariance)
{
  if (patch.type.surface != SurfaceType::Sphere &&
      patch.type.surface != SurfaceType::CircularCylinder)
    return true;
  const int k = layoutOf(patch.type).k();
  return std::abs(patch.kappa[0]) >= kUnobservableSigmas * std::sqrt(covariance(k, k));
}

FitStatus
observability(const Patch& patch, const ParameterMatrix& covariance)
{
  if (!covariance.allFinite())
    return FitStatus::NonFinite;
  if (!curvatureObservable(patch, covariance))
    return FitStatus::CurvatureNotObservable;
  if (axisSigma(patch, covariance) > kUnobservableAngle)
    return FitStatus::AxisNotObservable;
  return FitStatus::Converged;
}

} // namespace

std::string_view
covarianceModeName(CovarianceMode mode)
{
  return mode == CovarianceMode::Exact ? "exact" : "gauss_newton";
}

ParameterMatrix
patchCovariance(const PatchFit& fit,
                const PointBatch& batch,
                const FitOptions& options,
                CovarianceMode mode)
{
  if (fit.status != FitStatus::Converged)
    return {};
  const PatchJacobian& F = fit.bounded.jacobian;
  const Linearization& l = fit.surface.linearization;
  // d(estimate)/dq_i = G X_i + M D_i.
  const ByTheta G =
      gain(F.middleCols<6>(JointLayout::kTheta), hessianOf(fit.surface, mode));
  const ByMoments M = F.middleCols<9>(JointLayout::kMean) + G * l.A;
  const ParameterMatrix cross = G * (l.XD * M.transpose());
  ParameterMatrix covariance = G * (l.XX * G.transpose()) + cross + cross.transpose() +
                               M * (l.DD * M.transpose());
  if (fit.has_plane_stage)
    covariance += planeStageTerms(fit, batch, options, G, M, mode);
  return covariance;
}

PatchEstimator::PatchEstimator(const FitOptions& options, CovarianceMode mode)
: fitter_(options), mode_(mode)
{}

FitResult
PatchEstimator::estimate(PointBatch& batch) const
{
  const PatchFit fit = fitter_.fit(batch);
  FitResult result;
  result.status = fit.status;
  result.patch = fit.bounded.patch;
  result.chi2 = 2.0 * fit.surface.cost;
  result.chi2_dof = fit.points - kernel::parameterCount(fit.surface.surface.model);
  result.points = fit.points;
  result.invalid_points = fit.invalid_points;
  result.iterations = fit.surface.iterations;
  result.polish_steps = fit.surface.polish_steps;
  result.null_space = fit.null_space;
  if (fit.status == FitStatus::Converged) {
    result.covariance = patchCovariance(fit, batch, fitter_.options(), mode_);
    result.status = observability(result.patch, result.covariance);
    if (!isUsable(result.status))
      result.covariance.resize(0, 0);
  }
  return result;
}

FitResult
estimatePatch(PointBatch& batch, const FitOptions& options, CovarianceMode mode)
{
  return PatchEstimator(options, mode).estimate(batch);
}

} // namespace holdfast
