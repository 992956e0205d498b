#include "stagewise.h"

#include "geometry/symmetric.h"
#include "uncertainty/stagewise_stages.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace stagewise {
namespace {

using Eigen::Vector3d;
using kernel::Model;

// Sphere and cylinder with a smaller curvature are taken to have this, as by the fit.
constexpr double kSmallestCurvature = 1e-6;

// "From the WLM": theta in the fit's own axes with the inverse of J^T J.
template <int N>
Estimate<N>
fromWeightedFit(const SurfaceFit& fit, const Vec<N>& theta)
{
  const Mat<N, N> JtJ = fit.JtJ.topLeftCorner<N, N>();
  return {theta, JtJ.llt().solve(Mat<N, N>::Identity())};
}

double
curvatureOf(const SurfaceFit& fit)
{
  const double k = fit.surface.k[0];
  return std::copysign(std::max(std::abs(k), kSmallestCurvature), k);
}

// Coordinates, and the scatter in them.
struct Axes {
  Pose pose; // relative to the batch's origin
  Scatter scatter;
};

Axes
axesOf(const UnboundedSurface& surface, const Scatter& scatter)
{
  Axes axes{{surface.R, surface.c}, scatter};
  axes.scatter.mean = axes.pose.toLocal(scatter.mean);
  axes.scatter.covariance = surface.R.transpose() * scatter.covariance * surface.R;
  axes.scatter.axes = surface.R.transpose() * scatter.axes;
  return axes;
}

// By how many sigmas of the points a bound is away.
double
boundPerSigma(SurfaceType surface, const FitOptions& options)
{
  return std::sqrt(squaredBoundPerMoment(surface, options.containment));
}

// The chain for one fit. It runs in the axes of the fitted surface, where no r_xy is
// near the singularity of its chart; the covariance does not depend on the frame.
class Chain {
public:
  Chain(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
  : fit_(fit)
  , batch_(batch)
  , lambda_(boundPerSigma(SurfaceType::EllipticParaboloid, options))
  , plane_factor_(boundPerSigma(SurfaceType::Plane, options) / std::sqrt(2.0))
  , smooth_(options.smooth_circle_radius)
  , axes_(axesOf(fit.surface.surface, fit.scatter))
  , patch_x_(axes_.pose.R.transpose() * expMap(fit.bounded.patch.r).col(0))
  {}

  // Fig. 4 from left to right.
  ChainResult run() const
  {
    switch (fit_.bounded.patch.type.surface) {
    case SurfaceType::Plane:
      return boundedPlane(fit_.surface.surface.model == Model::Plane ?
                              plane(fit_.surface) :
                              propagated(planeFromParaboloid, paraboloid()));
    case SurfaceType::Sphere:
      return boundedRevolute(sphere());
    case SurfaceType::CircularCylinder:
      return boundedCylinder(cylinder());
    case SurfaceType::CircularParaboloid:
      return boundedRevolute(propagated(circularFromParaboloid, paraboloid()));
    case SurfaceType::CylindricParaboloid:
      return boundedCylinder(propagated(cylindricCurvature, principalParaboloid()));
    case SurfaceType::EllipticParaboloid:
    case SurfaceType::HyperbolicParaboloid:
      break;
    }
    return boundedParaboloid(principalParaboloid());
  }

private:
  // Stage I-1: [r_xy c'].
  Estimate<5> plane(const SurfaceFit& fit) const
  {
    const Pose pose{axes_.pose.R.transpose() * fit.surface.R,
                    axes_.pose.toLocal(fit.surface.c)};
    const auto fitted =
        propagated([&](const Vec<3>& theta) { return planeFromTheta(pose, theta); },
                   fromWeightedFit<3>(fit, Vec<3>::Zero()));
    const Estimate<3> centroid{
        axes_.scatter.mean,
        fit_.surface.linearization.DD.topLeftCorner<3, 3>()}; // sum Sigma_i / N^2
    return propagated(projectedCentre, independent(centroid, fitted));
  }

  // The normal that sphere and cylinder take from stage I-1, as r_xy: of the weighted
  // plane or, departing from the paper, of the scatter.
  Estimate<2> normal() const
  {
    if (fit_.has_plane_stage) {
      const Estimate<5> fitted = plane(fit_.plane);
      return {fitted.mean.head<2>(), fitted.covariance.topLeftCorner<2, 2>()};
    }
    const Estimate<6> entries{symmetric::entriesOf(axes_.scatter.covariance),
                              fit_.surface.linearization.DD.bottomRightCorner<6, 6>()};
    return propagated(
        [&](const Vec<6>& x) { return principalNormal(axes_.scatter.normal(), x); },
        entries);
  }

  // Stage I-2: [K r c].
  Estimate<9> paraboloid() const
  {
    Vec<6> theta = Vec<6>::Zero();
    theta.head<3>() = fit_.surface.surface.k;
    return propagated(
        [&](const Vec<6>& x) { return paraboloidFromTheta(axes_.scatter.normal(), x); },
        fromWeightedFit<6>(fit_.surface, theta));
  }

  // Stage I-2: [k r_xy c].
  Estimate<6> sphere() const
  {
    const Vec<4> theta(curvatureOf(fit_.surface), 0.0, 0.0, 0.0);
    const auto fitted =
        propagated(sphereFromTheta, fromWeightedFit<4>(fit_.surface, theta));
    return propagated(sphereApex, independent(normal(), fitted));
  }

  // Stage I-2: [k r c].
  Estimate<7> cylinder() const
  {
    Vec<5> theta = Vec<5>::Zero();
    theta[0] = curvatureOf(fit_.surface);
    const double sense = patch_x_.x() < 0.0 ? -1.0 : 1.0;
    const auto fitted =
        propagated([&](const Vec<5>& x) { return cylinderFromTheta(sense, x); },
                   fromWeightedFit<5>(fit_.surface, theta));
    const auto z = propagated(normalVector, normal());
    return propagated(cylinderApex, independent(z, fitted));
  }

  // Stage I-3: [kappa_x kappa_y r c], axes swapped and reversed to those of the patch.
  Estimate<8> principalParaboloid() const
  {
    auto x = propagated(principalCurvatures, paraboloid());
    const Vector3d local = expMap(x.mean.segment<3>(2)).transpose() * patch_x_;
    if (std::abs(local.y()) > std::abs(local.x()))
      x = propagated(swappedAxes, x);
    return opposesPatch(x.mean.segment<3>(2)) ? propagated(reversedAxes, x) : x;
  }

  bool opposesPatch(const Vector3d& r) const
  {
    return expMap(r).col(0).dot(patch_x_) < 0.0;
  }

  // Stage II-5: [m k r c].
  template <int NK, int NR>
  Estimate<NK + NR + 8> withMoments(const Axes& axes,
                                    const Estimate<NK + NR + 3>& surface) const
  {
    auto all = propagated(
        [&](const Vec<NK + NR + 3>& x) {
          return momentsAndSurface<NK, NR>(axes.scatter, x);
        },
        surface);
    const Vec<NR> r = surface.mean.template segment<NR>(NK);
    const Pose local{expMap(rotationOf<NR>(r)), surface.mean.template tail<3>()};
    all.covariance.template topLeftCorner<5, 5>() += noiseOfMoments(axes.pose * local);
    return all;
  }

  // The points' part of eq. (11), sum_i (dm/dq_i) Sigma_i (dm/dq_i)^T. The points count
  // as independent of the surface they gave.
  Mat<5, 5> noiseOfMoments(const Pose& local) const
  {
    Mat<5, 5> noise = Mat<5, 5>::Zero();
    for (int i = 0; i < batch_.size(); ++i) {
      const Vector3d q = local.toLocal(batch_.point(i) - batch_.origin());
      const Mat<3, 2> xy = local.R.leftCols<2>();
      const Mat<2, 2> Sigma = xy.transpose() * batch_.covariance(i) * xy;
      noise += propagate(momentsByPoint(q.x(), q.y(), batch_.size()), Sigma);
    }
    return noise;
  }

  // Stage II-6.
  ChainResult boundedCylinder(const Estimate<7>& surface) const
  {
    return inWorld<3, 3>(
        axes_.pose,
        propagated([&](const Vec<12>& x) { return cylinderBound(lambda_, x); },
                   withMoments<1, 3>(axes_, surface)));
  }

  // Stage II-7. Which moment is the larger depends on how the frame is turned about z,
  // so here r_xy has to be that of the result: in world axes.
  ChainResult boundedRevolute(const Estimate<6>& surface) const
  {
    const Axes world{{}, fit_.scatter};
    const auto moved =
        propagated([&](const Vec<6>& x) { return movedPatch<1, 2>(axes_.pose, x); },
                   surface);
    return inWorld<2, 2>(
        world.pose,
        propagated([&](const Vec<11>& x) { return circleBound(lambda_, smooth_, x); },
                   withMoments<1, 2>(world, moved)));
  }

  // Stage II-8.
  ChainResult boundedParaboloid(const Estimate<8>& surface) const
  {
    return inWorld<4, 3>(
        axes_.pose,
        propagated([&](const Vec<13>& x) { return ellipseBound(lambda_, x); },
                   withMoments<2, 3>(axes_, surface)));
  }

  // Stage II-9.
  ChainResult boundedPlane(const Estimate<5>& surface) const
  {
    const auto x =
        propagated([&](const Vec<10>& in) { return planeAxes(plane_factor_, in); },
                   withMoments<0, 2>(axes_, surface));
    const BoundaryType boundary = fit_.bounded.patch.type.boundary;
    if (boundary == BoundaryType::Circle)
      return inWorld<1, 2>(axes_.pose,
                           propagated(
                               [&](const Vec<10>& in) {
                                 return planeCircle(plane_factor_, smooth_, in);
                               },
                               x));
    const Vec<8> forward = planeEllipse(false, x.mean).value;
    const bool reversed = opposesPatch(forward.segment<3>(2));
    if (boundary == BoundaryType::Quad)
      return inWorld<5, 3>(
          axes_.pose,
          propagated([&](const Vec<10>& in) { return planeQuad(reversed, in); }, x));
    return inWorld<2, 3>(
        axes_.pose,
        propagated([&](const Vec<10>& in) { return planeEllipse(reversed, in); }, x));
  }

  template <int ND, int NR>
  ChainResult inWorld(const Pose& from, const Estimate<ND + NR + 3>& patch) const
  {
    const Pose to_world{from.R, from.c + batch_.origin()};
    const auto moved = propagated(
        [&](const Vec<ND + NR + 3>& x) { return movedPatch<ND, NR>(to_world, x); },
        patch);
    return {moved.mean, moved.covariance};
  }

  const PatchFit& fit_;
  const PointBatch& batch_;
  double lambda_; // of stage II-4: sqrt(2) erfinv(Gamma)
  double plane_factor_; // of II-9: sqrt(-ln(1 - Gamma))
  bool smooth_;
  Axes axes_; // of the fitted surface
  Vector3d patch_x_; // x axis of the result, in axes_
};

} // namespace

ChainResult
runChain(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
{
  return Chain(fit, batch, options).run();
}

} // namespace stagewise

namespace {

PointBatch
independentPoints(const PointBatch& batch)
{
  PointBatch independent;
  independent.clear(batch.origin(), batch.viewpoint());
  for (int i = 0; i < batch.size(); ++i)
    independent.add(batch.point(i), batch.covariance(i));
  return independent;
}

} // namespace

ParameterMatrix
stagewiseCovariance(const PatchFit& fit,
                    const PointBatch& batch,
                    const FitOptions& options)
{
  if (fit.status != FitStatus::Converged)
    return {};
  if (batch.pattern() != nullptr) {
    // The sums of a fit that knows what errors share are no longer those of independent
    // ones, which are all that the paper's stages know.
    PointBatch independent = independentPoints(batch);
    const PatchFit same = PatchFitter(options).fit(independent);
    return stagewiseCovariance(same, independent, options);
  }
  return stagewise::runChain(fit, batch, options).covariance;
}

} // namespace holdfast
