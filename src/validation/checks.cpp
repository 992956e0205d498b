#include <holdfast/validation/checks.h>
#include <holdfast/validation/names.h>

#include <array>
#include <stdexcept>

namespace holdfast {
namespace {

// Written so that what is not a number does not pass.
bool
isWithin(double value, std::optional<double> limit)
{
  return !limit || value <= *limit;
}

PatchVerdict
judge(const Validation& measured, const ValidationOptions& options)
{
  if (measured.residual.points == 0)
    return PatchVerdict::NotUsable;
  if (!isWithin(measured.curvature_per_m, options.max_curvature_per_m))
    return PatchVerdict::CurvatureTooLarge;
  if (!isWithin(measured.residual.rms_m, options.max_residual_m))
    return PatchVerdict::ResidualTooLarge;
  if (options.min_coverage && measured.coverage.share < *options.min_coverage)
    return PatchVerdict::CoverageTooLow;
  if (!isWithin(measured.chi2_per_dof, options.max_chi2_per_dof))
    return PatchVerdict::ChiSquareTooLarge;
  return PatchVerdict::Accepted;
}

template <typename Points>
Validation
check(const FitResult& fit, const Points& points, const ValidationOptions& options)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument(error);
  Validation validation;
  if (!isUsable(fit.status))
    return validation;
  validation.curvature_per_m =
      fit.patch.principalCurvatures().lpNorm<Eigen::Infinity>();
  validation.residual = measureResidual(fit.patch, points);
  validation.coverage = measureCoverage(fit.patch, points, options.coverage);
  validation.chi2_per_dof = chi2PerDof(fit);
  validation.verdict = judge(validation, options);
  return validation;
}

} // namespace

std::string
validityError(const ValidationOptions& options)
{
  const auto isBad = [](std::optional<double> limit) {
    return limit && !(*limit > 0.0);
  };
  if (isBad(options.max_curvature_per_m))
    return "max_curvature_per_m must be a positive number";
  if (isBad(options.max_residual_m))
    return "max_residual_m must be a positive number";
  if (options.min_coverage &&
      !(*options.min_coverage >= 0.0 && *options.min_coverage <= 1.0))
    return "min_coverage must lie between 0 and 1";
  if (isBad(options.max_chi2_per_dof))
    return "max_chi2_per_dof must be a positive number";
  return validityError(options.coverage);
}

std::string_view
verdictName(PatchVerdict verdict)
{
  return kVerdictNames.of(verdict);
}

Validation
validate(const FitResult& fit,
         const PointBatch& points,
         const ValidationOptions& options)
{
  return check(fit, points, options);
}

Validation
validate(const FitResult& fit,
         const std::vector<Eigen::Vector3d>& points,
         const ValidationOptions& options)
{
  return check(fit, points, options);
}

} // namespace holdfast
