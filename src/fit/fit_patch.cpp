#include "fit_patch.h"

#include "fit/models/models.h"

#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

using kernel::Model;

Model
modelOf(SurfaceRequest request)
{
  const std::optional<SurfaceType> type = surfaceOf(request);
  return type ? modelOf(*type) : Model::Paraboloid;
}

bool
hasExtent(const Scatter& scatter)
{
  // Finite, and at least one direction in which the points spread.
  return scatter.covariance.allFinite() && scatter.eigenvalues[2] > 0.0;
}

bool
curvatureInRange(const SurfaceFit& fit, double limit)
{
  return withModel(fit.surface.model,
                   [&](auto m) { return m.largestCurvature(fit.surface.k) <= limit; });
}

// True when the paraboloid rises by less than the limit at the bounds along the points'
// longer axis: kappa d^2 / 2.
bool
isFlatWithin(double limit, const PatchFit& fit, double squared_bound)
{
  const double curvature = models::Paraboloid::largestCurvature(fit.surface.surface.k);
  const double squared = squared_bound * fit.scatter.eigenvalues[2];
  return 0.5 * curvature * squared < limit;
}

SurfaceType
signedType(const Eigen::Vector3d& k)
{
  return k[0] * k[2] - k[1] * k[1] < 0.0 ? SurfaceType::HyperbolicParaboloid :
                                           SurfaceType::EllipticParaboloid;
}

} // namespace

PatchFitter::PatchFitter(const FitOptions& options, kernel::Precision coarsest)
: options_(options), coarsest_(coarsest)
{
  const std::string error = validityError(options);
  if (!error.empty())
    throw std::invalid_argument(error);
  const auto squaredBound = [&](SurfaceType surface) {
    return squaredBoundPerMoment(surface, options.containment);
  };
  bound_settings_ = {squaredBound(SurfaceType::EllipticParaboloid),
                     squaredBound(SurfaceType::Plane),
                     options.smooth_circle_radius,
                     options.centre_on_normal_line};
  thresholds_ = DiscriminationThresholds::atLevel(options.discrimination_level);
}

PatchType
PatchFitter::patchType(const PatchFit& fit) const
{
  const auto typed = [this](SurfaceType surface) {
    return PatchType{surface,
                     surface == SurfaceType::Plane && options_.plane_boundary ?
                         *options_.plane_boundary :
                         defaultBoundary(surface)};
  };
  const SurfaceFit& surface = fit.surface;
  if (const std::optional<SurfaceType> forced = surfaceOf(options_.surface))
    return typed(*forced);
  if (options_.surface == SurfaceRequest::Paraboloid)
    return typed(signedType(surface.surface.k));
  const ThetaMatrix covariance =
      thetaCovariance(surface.linearization, surface.linearization.H);
  if (isFlatWithin(options_.flat_within_m, fit, bound_settings_.squared_bound))
    return typed(SurfaceType::Plane);
  return typed(discriminate(surface.surface.k,
                            covariance.topLeftCorner<3, 3>(),
                            thresholds_,
                            options_));
}

BoundedPatch
PatchFitter::bound(const BoundRequest& request) const
{
  return boundPatch(request, bound_settings_);
}

PatchFit
PatchFitter::fit(PointBatch& batch) const
{
  PatchFit fit;
  fit.invalid_points = batch.removeInvalid();
  batch.applyFloor(options_.sigma_floor_m);
  fit.uninformative_points = batch.removeUninformative();
  fit.points = batch.size();
  if (fit.points < kernel::parameterCount(modelOf(options_.surface)))
    return fit;
  batch.pad();
  if (batch.pattern() != nullptr)
    fit.support = PatternSupport(batch);
  runStages(batch, coarsest_, fit);
  return fit;
}

PatchFit
PatchFitter::refit(const PointBatch& batch, const PatchFit& coarse) const
{
  PatchFit fit;
  fit.invalid_points = coarse.invalid_points;
  fit.uninformative_points = coarse.uninformative_points;
  fit.points = coarse.points;
  fit.support = coarse.support;
  runStages(batch, kernel::Precision::Double, fit);
  return fit;
}

void
PatchFitter::runStages(const PointBatch& batch,
                       kernel::Precision coarsest,
                       PatchFit& fit) const
{
  const Model model = modelOf(options_.surface);
  // Stage I-1 (i): principal axes.
  fit.scatter = measureScatter(batch,
                               options_.debias_scatter,
                               batch.viewpoint() - batch.origin());
  if (!hasExtent(fit.scatter)) {
    fit.status = fit.scatter.covariance.allFinite() ? FitStatus::Degenerate :
                                                      FitStatus::NonFinite;
    return;
  }
  // Stage I-1 (i), s != parab: the paper's weighted plane.
  fit.has_plane_stage = !options_.normal_from_pca && wraps(model);
  if (fit.has_plane_stage) {
    fit.plane =
        fitSurface(Model::Plane, batch, fit.scatter, fit.support, options_, coarsest);
    fit.status = fit.plane.status;
    fit.null_space = fit.plane.null_space;
    if (fit.status != FitStatus::Converged)
      return;
  }
  // Stage I-2 (for planes: I-1's refit).
  fit.surface = fitSurface(model, batch, fit.scatter, fit.support, options_, coarsest);
  fit.status = fit.surface.status;
  fit.null_space = fit.surface.null_space;
  if (fit.status != FitStatus::Converged && fit.status != FitStatus::IterationLimit)
    return;
  if (!curvatureInRange(fit.surface, options_.max_curvature_per_m)) {
    fit.status = FitStatus::CurvatureOutOfRange;
    return;
  }
  // Stage I-3, then II-4 to II-9.
  fit.bounded = bound({patchType(fit),
                       fit.surface.surface,
                       fit.scatter,
                       fit.normalPlane(),
                       batch.origin()});
  if (fit.status == FitStatus::Converged)
    fit.status = fit.bounded.status;
}

} // namespace holdfast
