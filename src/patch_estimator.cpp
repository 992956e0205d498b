#include <holdfast/patch_estimator.h>

#include "fit/fit_patch.h"
#include "uncertainty/covariance.h"

namespace holdfast {

struct PatchEstimator::Impl {
  PatchFitter fitter;
  CovarianceMode mode;
};

namespace {

// The stages of a propagation have terms that cancel.
kernel::Precision
coarsestFor(CovarianceMode mode)
{
  return mode == CovarianceMode::Stagewise ? kernel::Precision::Double :
                                             kernel::Precision::Single;
}

// Single precision leaves some 1e-7 of the terms of a variance: of what they exceed by
// more than this, a ten-thousandth cannot be had.
constexpr double kMostCancellation = 1e3;

// Terms of the covariance of a centre out of reach all but cancel, as may those of
// shared errors.
bool
isWorthAllDigits(const PatchFit& fit,
                 const PatchCovariance& uncertainty,
                 const FitResult& result)
{
  return fit.surface.precision == kernel::Precision::Single &&
         fit.status == FitStatus::Converged &&
         (!isUsable(result.status) || result.flags.curvature_not_observable ||
          uncertainty.cancellation > kMostCancellation);
}

void
attach(const PatchFit& fit, const PatchCovariance& uncertainty, FitResult& result)
{
  result.chi2_expected = expectedChi2(fit);
  result.status = statusOf(fit.bounded.patch, uncertainty);
  if (!isUsable(result.status))
    return;
  const Linearity linearity = linearityOf(fit, uncertainty);
  result.flags = linearity.flags;
  result.nonlinearity = linearity.nonlinearity;
  result.state_covariance = uncertainty.state;
  result.white_state_covariance = uncertainty.white_state;
  result.state_mean_shift = uncertainty.state_shift;
  result.covariance = uncertainty.parameters;
  result.mean_shift = uncertainty.shift;
}

} // namespace

PatchEstimator::PatchEstimator(const FitOptions& options, CovarianceMode mode)
: impl_(
      std::make_shared<const Impl>(Impl{PatchFitter(options, coarsestFor(mode)), mode}))
{}

namespace {

FitResult
resultOf(const PatchFit& fit, const PatchCovariance& uncertainty)
{
  FitResult result;
  result.status = fit.status;
  result.patch = fit.bounded.patch;
  result.state = fit.bounded.state;
  result.chi2 = 2.0 * fit.surface.cost;
  result.chi2_dof = fit.points - kernel::parameterCount(fit.surface.surface.model);
  result.points = fit.points;
  result.invalid_points = fit.invalid_points;
  result.uninformative_points = fit.uninformative_points;
  result.iterations = fit.surface.iterations;
  result.polish_steps = fit.surface.polish_steps;
  result.null_space = fit.null_space;
  if (fit.status == FitStatus::Converged)
    attach(fit, uncertainty, result);
  return result;
}

} // namespace

FitResult
PatchEstimator::estimate(PointBatch& batch) const
{
  const auto& [fitter, mode] = *impl_;
  const PatchFit fit = fitter.fit(batch);
  const PatchCovariance uncertainty = patchCovariance(fit, batch, fitter, mode);
  FitResult result = resultOf(fit, uncertainty);
  if (isWorthAllDigits(fit, uncertainty, result)) {
    const PatchFit again = fitter.refit(batch, fit);
    result = resultOf(again, patchCovariance(again, batch, fitter, mode));
  }
  return result;
}

FitResult
estimatePatch(PointBatch& batch, const FitOptions& options, CovarianceMode mode)
{
  return PatchEstimator(options, mode).estimate(batch);
}

} // namespace holdfast
