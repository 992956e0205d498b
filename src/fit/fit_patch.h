/// \file The fit of one bounded patch, paper sections II and III, stage by stage.
#pragma once

#include "boundary_fit.h"
#include "discrimination.h"
#include "surface_fit.h"
#include <holdfast/fit/options.h>
#include <holdfast/fit/point_batch.h>

namespace holdfast {

/// A fitted patch with everything its covariance is computed from.
struct PatchFit {
  FitStatus status = FitStatus::TooFewPoints;
  PatternSupport support; ///< measured where the batch has a pattern
  Scatter scatter;
  SurfaceFit surface;
  /// Stage I-1 as a weighted plane, when sphere or cylinder take their normal from it.
  bool has_plane_stage = false;
  SurfaceFit plane;
  BoundedPatch bounded;
  NullSpace null_space = NullSpace(6, 0);
  int points = 0;
  int invalid_points = 0;
  int uninformative_points = 0;

  const UnboundedSurface* normalPlane() const
  {
    return has_plane_stage ? &plane.surface : nullptr;
  }
};

/// Fits patches under one set of options; checks them and works out what depends on
/// them once. Const and free of state: one fitter serves any number of threads.
class PatchFitter {
public:
  /// \param coarsest precision that will do.
  /// \throw std::invalid_argument when the options make no sense (validityError).
  explicit PatchFitter(const FitOptions& options,
                       kernel::Precision coarsest = kernel::Precision::Single);

  /// The stages in order. Bad data come back as a status, never as an exception.
  /// \param batch is cleaned of invalid points and padded.
  PatchFit fit(PointBatch& batch) const;

  /// The same again, with all digits, for a batch as fit() left it.
  PatchFit refit(const PointBatch& batch, const PatchFit& coarse) const;

  /// Stages II-4 to II-9 again, for a surface near the fitted one (what a second-order
  /// propagation differentiates).
  BoundedPatch bound(const BoundRequest& request) const;

  const FitOptions& options() const
  {
    return options_;
  }

private:
  /// From I-1 on. \param fit with the counts and the support of the batch.
  void runStages(const PointBatch& batch,
                 kernel::Precision coarsest,
                 PatchFit& fit) const;
  PatchType patchType(const PatchFit& fit) const;

  FitOptions options_;
  kernel::Precision coarsest_;
  BoundSettings bound_settings_;
  DiscriminationThresholds thresholds_;
};

} // namespace holdfast
