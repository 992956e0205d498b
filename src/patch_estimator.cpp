#include <holdfast/patch_estimator.h>

#include "fit/fit_patch.h"
#include "uncertainty/covariance.h"

namespace holdfast {

struct PatchEstimator::Impl {
  PatchFitter fitter;
  CovarianceMode mode;
};

namespace {

void
attach(const PatchFit& fit, const PatchCovariance& uncertainty, FitResult& result)
{
  result.chi2_expected = expectedChi2(fit);
  result.status = statusOf(fit, uncertainty);
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
: impl_(std::make_shared<const Impl>(Impl{PatchFitter(options), mode}))
{}

FitResult
PatchEstimator::estimate(PointBatch& batch) const
{
  const PatchFit fit = impl_->fitter.fit(batch);
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
  if (fit.status == FitStatus::Converged) {
    const PatchCovariance uncertainty =
        patchCovariance(fit, batch, impl_->fitter, impl_->mode);
    attach(fit, uncertainty, result);
  }
  return result;
}

FitResult
estimatePatch(PointBatch& batch, const FitOptions& options, CovarianceMode mode)
{
  return PatchEstimator(options, mode).estimate(batch);
}

} // namespace holdfast
