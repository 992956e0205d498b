#include "evaluation/fit_error.h"

#include "geometry/symmetric_eigen.h"

#include <holdfast/geometry/rotation.h>

#include <boost/math/distributions/chi_squared.hpp>

#include <cmath>
#include <limits>

namespace holdfast {
namespace {

/// Of the state, about the estimate and in its frame.
StateVector
stateDifference(const FitResult& fit, const PatchState& reference)
{
  StateVector error = -difference(reference, fit.state);
  if (fit.state_mean_shift->size() > 0)
    error += *fit.state_mean_shift;
  return error;
}

StateMatrix
freeCoordinates(PatchType type)
{
  const StateLayout layout = stateLayoutOf(type);
  StateMatrix T = StateMatrix::Identity(layout.size(), layout.size());
  if (type.surface != SurfaceType::CircularCylinder)
    return T;
  const int k = layout.k(), rest = layout.size() - k - 3;
  StateMatrix free = StateMatrix::Zero(layout.size() - 1, layout.size());
  free.topLeftCorner(k, k).setIdentity();
  free(k, k) = 1.0;
  free(k, k + 2) = -1.0;
  free(k + 1, k + 1) = 1.0;
  free.bottomRightCorner(rest, rest).setIdentity();
  return free;
}

} // namespace

Mahalanobis
mahalanobis(const ParameterVector& error, const ParameterMatrix& covariance)
{
  // Parameters differ in unit: scale to correlations, so that one tolerance decides.
  constexpr double kNull = 1e-9;
  const ParameterVector inverse = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen =
      symmetricEigen(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  const ParameterVector y = eigen.vectors.transpose() * inverse.cwiseProduct(error);
  Mahalanobis result;
  for (int i = 0; i < y.size(); ++i)
    if (eigen.values[i] > kNull) {
      result.squared += y[i] * y[i] / eigen.values[i];
      ++result.rank;
    }
  return result;
}

NormalizedError
normalizedError(const ParameterVector& error, const ParameterMatrix& covariance)
{
  const Mahalanobis m = mahalanobis(error, covariance);
  const boost::math::chi_squared chi2(m.rank);
  return {m.squared / m.rank, m.squared <= boost::math::quantile(chi2, 0.95)};
}

ParameterVector
tangentError(const Patch& patch, const Patch& reference)
{
  const ParameterLayout layout = layoutOf(reference.type);
  ParameterVector error = pack(patch) - pack(reference);
  const Eigen::Vector3d delta =
      logMap(expMap(reference.r).transpose() * expMap(patch.r));
  error.segment(layout.r(), layout.r_count) = delta.head(layout.r_count);
  return error;
}

ParameterVector
tangentShift(const FitResult& fit)
{
  if (fit.mean_shift->size() == 0)
    return ParameterVector::Zero(layoutOf(fit.patch.type).size());
  return tangentJacobian(fit.patch) * *fit.mean_shift;
}

NormalizedError
parameterError(const FitResult& fit, const Patch& reference)
{
  return normalizedError(tangentError(fit.patch, reference) + tangentShift(fit),
                         toTangent(fit.patch, fit.covariance));
}

NormalizedError
stateError(const FitResult& fit, const PatchState& reference)
{
  const StateMatrix T = freeCoordinates(fit.state.type);
  return normalizedError(T * stateDifference(fit, reference),
                         T * fit.state_covariance * T.transpose());
}

void
addGroupErrors(const FitResult& fit, const PatchState& reference, StateTallies& tallies)
{
  const StateLayout layout = stateLayoutOf(fit.state.type);
  const StateMatrix T = freeCoordinates(fit.state.type);
  const StateVector error = T * stateDifference(fit, reference);
  const StateMatrix S = T * fit.state_covariance * T.transpose();
  const auto judge = [&](ErrorTally& tally, Eigen::Index first, Eigen::Index size) {
    if (size > 0)
      add(tally,
          normalizedError(error.segment(first, size),
                          S.block(first, first, size, size)));
  };
  const Eigen::Index k = layout.k(), c = T.rows() - 3, nu = c - 2;
  judge(tallies.moments, 0, k);
  judge(tallies.curvature, k, nu - k);
  judge(tallies.normal, nu, 2);
  judge(tallies.centre, c, 3);
  add(tallies.surface, surfaceError(fit, reference));
}

NormalizedError
surfaceError(const FitResult& fit, const PatchState& reference)
{
  const StateLayout layout = stateLayoutOf(fit.state.type);
  StateMatrix J = StateMatrix::Zero(3, layout.size());
  J.block<2, 2>(0, layout.nu()).setIdentity();
  J.block<1, 3>(2, layout.c()) = fit.state.normal.transpose();
  return normalizedError(J * stateDifference(fit, reference),
                         J * fit.state_covariance * J.transpose());
}

double
curvatureInSigmas(const FitResult& fit)
{
  if (curvatureParameterCount(fit.patch.type.surface) == 0)
    return std::numeric_limits<double>::infinity();
  const int k = layoutOf(fit.patch.type).k();
  return std::abs(fit.patch.kappa[0]) / std::sqrt(fit.covariance(k, k));
}

void
add(ErrorTally& tally, const NormalizedError& error)
{
  add(tally, {1, error.nees_per_dof, error.within95 ? 1.0 : 0.0});
}

void
add(ErrorTally& tally, const ErrorTally& other)
{
  tally.count += other.count;
  if (tally.count == 0)
    return;
  const double share = static_cast<double>(other.count) / tally.count;
  tally.nees_per_dof += share * (other.nees_per_dof - tally.nees_per_dof);
  tally.coverage95 += share * (other.coverage95 - tally.coverage95);
}

void
add(StateTallies& tallies, const StateTallies& others)
{
  add(tallies.moments, others.moments);
  add(tallies.curvature, others.curvature);
  add(tallies.normal, others.normal);
  add(tallies.centre, others.centre);
  add(tallies.surface, others.surface);
}

} // namespace holdfast
