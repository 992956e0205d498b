#include <holdfast/fit/names.h>
#include <holdfast/fit/result.h>

#include <cmath>
#include <limits>
#include <optional>

namespace holdfast {
namespace {

// Results read from files may claim a status without bringing the covariance.
bool
hasCovariance(const FitResult& fit)
{
  const int size = layoutOf(fit.patch.type).size();
  return isUsable(fit.status) && fit.covariance.rows() == size &&
         fit.covariance.cols() == size;
}

bool
hasState(const FitResult& fit)
{
  const int size = stateLayoutOf(fit.patch.type).size();
  return isUsable(fit.status) && fit.state_covariance.rows() == size &&
         fit.state_covariance.cols() == size;
}

std::optional<Eigen::Matrix3d>
centreCovariance(const FitResult& fit)
{
  if (hasState(fit))
    return Eigen::Matrix3d(fit.state_covariance.bottomRightCorner<3, 3>());
  if (hasCovariance(fit))
    return Eigen::Matrix3d(fit.covariance.bottomRightCorner<3, 3>());
  return std::nullopt;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

} // namespace

std::string_view
statusName(FitStatus status)
{
  return kStatusNames.of(status);
}

bool
isUsable(FitStatus status)
{
  return status == FitStatus::Converged || status == FitStatus::AxisNotObservable ||
         status == FitStatus::CurvatureNotObservable;
}

ParameterMatrix
observableCovariance(const FitResult& fit)
{
  ParameterMatrix S = fit.covariance;
  const ParameterLayout layout = layoutOf(fit.patch.type);
  if (S.rows() != layout.size())
    return S;
  const auto hide = [&S](int first, int count) {
    S.middleRows(first, count).setConstant(kNaN);
    S.middleCols(first, count).setConstant(kNaN);
  };
  const bool axis_lost = fit.flags.axis_not_observable ||
                         (fit.patch.type.surface == SurfaceType::CircularCylinder &&
                          fit.flags.curvature_not_observable);
  if (axis_lost)
    hide(0, layout.c());
  else if (fit.flags.orientation_singular)
    hide(layout.r(), layout.r_count);
  return S;
}

double
normalSigma(const FitResult& fit)
{
  if (hasState(fit)) {
    const int nu = stateLayoutOf(fit.patch.type).nu();
    return std::sqrt(fit.state_covariance.block<2, 2>(nu, nu).trace());
  }
  if (!hasCovariance(fit))
    return kNaN;
  // A turn by delta about the local x and y axes moves the normal by as much.
  const ParameterMatrix tangent = toTangent(fit.patch, fit.covariance);
  const int r = layoutOf(fit.patch.type).r();
  return std::sqrt(tangent(r, r) + tangent(r + 1, r + 1));
}

double
centreSigma(const FitResult& fit)
{
  const auto centre = centreCovariance(fit);
  return centre ? std::sqrt(centre->trace()) : kNaN;
}

double
centreSigma(const FitResult& fit, const Eigen::Vector3d& direction)
{
  const auto centre = centreCovariance(fit);
  const Eigen::Vector3d unit = direction.normalized();
  return centre ? std::sqrt(unit.dot(*centre * unit)) : kNaN;
}

double
chi2PerDof(const FitResult& fit)
{
  const double expected = fit.chi2_expected > 0.0 ? fit.chi2_expected : fit.chi2_dof;
  return fit.chi2_dof > 0 && expected > 0.0 ? fit.chi2 / expected : 0.0;
}

} // namespace holdfast
