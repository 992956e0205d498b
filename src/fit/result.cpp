#include <holdfast/fit/names.h>
#include <holdfast/fit/result.h>

#include <cmath>
#include <limits>

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

double
normalSigma(const FitResult& fit)
{
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
  if (!hasCovariance(fit))
    return kNaN;
  return std::sqrt(fit.covariance.bottomRightCorner<3, 3>().trace());
}

double
centreSigma(const FitResult& fit, const Eigen::Vector3d& direction)
{
  if (!hasCovariance(fit))
    return kNaN;
  const Eigen::Vector3d unit = direction.normalized();
  const Eigen::Matrix3d centre = fit.covariance.bottomRightCorner<3, 3>();
  return std::sqrt(unit.dot(centre * unit));
}

double
chi2PerDof(const FitResult& fit)
{
  const double expected = fit.chi2_expected > 0.0 ? fit.chi2_expected : fit.chi2_dof;
  return fit.chi2_dof > 0 && expected > 0.0 ? fit.chi2 / expected : 0.0;
}

} // namespace holdfast
