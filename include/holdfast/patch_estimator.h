/// \file The front door of the core: points with covariances in, a bounded patch with
/// the covariance of its parameters out.
///
///     PointBatch batch;                          // fit/point_batch.h
///     batch.clear(origin);
///     batch.add(point, covariance);              // as many as there are
///     const FitResult result = PatchEstimator(FitOptions{}).estimate(batch);
///     if (isUsable(result.status))
///       use(result.patch, result.covariance);    // patch/parameters.h has the order
#pragma once

#include <holdfast/fit/options.h>
#include <holdfast/fit/point_batch.h>
#include <holdfast/fit/result.h>
#include <holdfast/uncertainty/covariance_mode.h>

#include <memory>

namespace holdfast {

/// Fits patches with covariance under one set of options. Const and free of state: one
/// estimator serves any number of threads.
class PatchEstimator {
public:
  /// \throw std::invalid_argument when the options make no sense (validityError).
  explicit PatchEstimator(const FitOptions& options,
                          CovarianceMode mode = CovarianceMode::Exact);

  /// Fits a patch and attaches the covariance of its parameters. Bad data never throw:
  /// they come back as a status.
  /// \param batch is cleaned of invalid points, given its sigma floor, and padded.
  FitResult estimate(PointBatch& batch) const;

private:
  struct Impl;
  std::shared_ptr<const Impl> impl_; ///< copies share it
};

/// One patch, for callers who have just one: PatchEstimator(options,
/// mode).estimate(batch).
FitResult estimatePatch(PointBatch& batch,
                        const FitOptions& options,
                        CovarianceMode mode = CovarianceMode::Exact);

} // namespace holdfast
