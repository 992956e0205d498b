#include <holdfast/validation/checks.h>
#include <holdfast/validation/names.h>

#include "local_points.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace holdfast {
namespace {

// Written so that what is not a number does not pass.
bool
isWithin(double value, std::optional<double> limit)
{
  return !limit || value <= *limit;
}

// What was not measured passes.
bool
isWithin(std::optional<double> value, std::optional<double> limit)
{
  return !value || isWithin(*value, limit);
}

// The same of a length in terms of the radius.
bool
isWithinRadii(double length_m, std::optional<double> limit, double radius_m)
{
  return radius_m <= 0.0 || !limit || length_m <= *limit * radius_m;
}

// Of the state's moments: bounds depend on the containment, too.
double
extentOf(const PatchState& state)
{
  const Eigen::Vector3d& m = state.moments;
  const double larger = 0.5 * (m[0] + m[2]) + std::hypot(0.5 * (m[0] - m[2]), m[1]);
  return 2.0 * std::sqrt(std::max(larger, 0.0));
}

double
sagittaOf(const Patch& patch)
{
  const double kappa = patch.principalCurvatures().lpNorm<Eigen::Infinity>();
  const double d = patch.d.head<2>().maxCoeff();
  return 0.5 * kappa * d * d;
}

double
noiseOf(const PointBatch& points)
{
  const double* xx = points.channel(PointBatch::SXX);
  const double* yy = points.channel(PointBatch::SYY);
  const double* zz = points.channel(PointBatch::SZZ);
  double sum = 0.0;
  for (int i = 0; i < points.size(); ++i)
    sum += xx[i] + yy[i] + zz[i];
  return std::sqrt(sum / std::max(points.size(), 1));
}

double
noiseOf(const std::vector<Eigen::Vector3d>&)
{
  return 0.0;
}

std::optional<double>
viewAngle(const Patch& patch, const PointBatch& points)
{
  const Eigen::Vector3d ray = points.viewpoint() - patch.c;
  const double cosine = patch.normal().dot(ray) / ray.norm();
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

std::optional<double>
viewAngle(const Patch&, const std::vector<Eigen::Vector3d>&)
{
  return std::nullopt;
}

template <typename Points>
Validation
check(const FitResult& fit,
      const Points& points,
      const ValidationOptions& options,
      double radius_m)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument(error);
  Validation validation;
  if (!isUsable(fit.status))
    return validation;
  validation.curvature_per_m =
      fit.patch.principalCurvatures().lpNorm<Eigen::Infinity>();
  validation.extent_m = extentOf(fit.state);
  validation.sagitta_m = sagittaOf(fit.patch);
  if (options.max_view_angle_rad)
    validation.view_angle_rad = viewAngle(fit.patch, points);
  validation.noise_m = noiseOf(points);
  const LocalPoints placed(fit.patch, points);
  validation.residual = residualOf(fit.patch, placed);
  validation.coverage = coverageOf(fit.patch, placed, options.coverage);
  validation.chi2_per_dof = chi2PerDof(fit);
  validation.verdict = verdictOf(validation, options, radius_m);
  return validation;
}

} // namespace

ValidationOptions
ValidationOptions::withoutLimits()
{
  ValidationOptions options;
  for (const auto limit : {&ValidationOptions::max_extent,
                           &ValidationOptions::max_sagitta,
                           &ValidationOptions::max_bend,
                           &ValidationOptions::max_departure,
                           &ValidationOptions::max_noise,
                           &ValidationOptions::max_stray,
                           &ValidationOptions::max_view_angle_rad,
                           &ValidationOptions::min_coverage,
                           &ValidationOptions::max_chi2_per_dof})
    options.*limit = std::nullopt;
  return options;
}

std::string
validityError(const ValidationOptions& options)
{
  using Limit = std::optional<double> ValidationOptions::*;
  constexpr std::pair<Limit, const char*> kPositive[] = {
      {&ValidationOptions::max_extent, "max_extent"},
      {&ValidationOptions::max_sagitta, "max_sagitta"},
      {&ValidationOptions::max_bend, "max_bend"},
      {&ValidationOptions::max_departure, "max_departure"},
      {&ValidationOptions::max_noise, "max_noise"},
      {&ValidationOptions::max_stray, "max_stray"},
      {&ValidationOptions::max_view_angle_rad, "max_view_angle_rad"},
      {&ValidationOptions::max_curvature_per_m, "max_curvature_per_m"},
      {&ValidationOptions::max_residual_m, "max_residual_m"},
      {&ValidationOptions::max_chi2_per_dof, "max_chi2_per_dof"}};
  for (const auto& [limit, name] : kPositive)
    if (const std::optional<double>& value = options.*limit; value && !(*value > 0.0))
      return std::string(name) + " must be a positive number";
  if (options.min_coverage &&
      !(*options.min_coverage >= 0.0 && *options.min_coverage <= 1.0))
    return "min_coverage must lie between 0 and 1";
  return validityError(options.coverage);
}

std::string_view
verdictName(PatchVerdict verdict)
{
  return kVerdictNames.of(verdict);
}

PatchVerdict
verdictOf(const Validation& measured, const ValidationOptions& options, double radius_m)
{
  if (measured.residual.points == 0)
    return PatchVerdict::NotUsable;
  if (!isWithinRadii(measured.noise_m, options.max_noise, radius_m))
    return PatchVerdict::NoiseTooLarge;
  if (!isWithinRadii(measured.extent_m, options.max_extent, radius_m))
    return PatchVerdict::ExtentTooLarge;
  if (!isWithinRadii(measured.sagitta_m, options.max_sagitta, radius_m))
    return PatchVerdict::SagittaTooLarge;
  if (!isWithin(measured.curvature_per_m, options.max_curvature_per_m) ||
      (radius_m > 0.0 &&
       !isWithin(measured.curvature_per_m * radius_m, options.max_bend)))
    return PatchVerdict::CurvatureTooLarge;
  if (!isWithin(measured.view_angle_rad, options.max_view_angle_rad))
    return PatchVerdict::NormalNotSeen;
  if (!isWithin(measured.residual.rms_m, options.max_residual_m))
    return PatchVerdict::ResidualTooLarge;
  if (!isWithinRadii(measured.residual.unexplained_m, options.max_departure, radius_m))
    return PatchVerdict::DepartureTooLarge;
  if (options.min_coverage && !(measured.coverage.share >= *options.min_coverage))
    return PatchVerdict::CoverageTooLow;
  if (!isWithin(measured.chi2_per_dof, options.max_chi2_per_dof))
    return PatchVerdict::ChiSquareTooLarge;
  if (!isWithin(measured.stray_share, options.max_stray))
    return PatchVerdict::OverEdge;
  return PatchVerdict::Accepted;
}

Validation
validate(const FitResult& fit,
         const PointBatch& points,
         const ValidationOptions& options,
         double radius_m)
{
  return check(fit, points, options, radius_m);
}

Validation
validate(const FitResult& fit,
         const std::vector<Eigen::Vector3d>& points,
         const ValidationOptions& options,
         double radius_m)
{
  return check(fit, points, options, radius_m);
}

} // namespace holdfast
