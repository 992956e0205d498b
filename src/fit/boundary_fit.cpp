#include "boundary_fit.h"

#include "fit/models/models.h"
#include "geometry/symmetric.h"
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <boost/math/special_functions/erf.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace holdfast {
namespace {

using Row = JointRow;
using Rows2 = JointRows2;
using Rows3 = JointRows3;

// A local frame, the moments of the points in it, and how both move with the joint
// variables. Rows are in the axes of R; gamma = R^T dc.
struct MomentFrame {
  Eigen::Matrix3d R;
  Eigen::Vector3d c; // relative to the batch's origin
  Eigen::Vector3d mean; // of the points, R^T (qbar - c)
  Eigen::Matrix3d M; // scatter about the mean, R^T C R
  Rows3 delta, gamma, dmean;
  Row dxx, dxy, dyy; // of M
};

// Moments in a placed frame. W: from the axes of the surface to those of the frame.
MomentFrame
measureMoments(const Placement& placement,
               const Scatter& scatter,
               const Eigen::Matrix3d& W)
{
  MomentFrame f;
  f.R = placement.R;
  f.c = placement.c;
  f.delta = placement.delta;
  f.gamma = placement.gamma;
  f.mean = f.R.transpose() * (scatter.mean - f.c);
  f.M = f.R.transpose() * scatter.covariance * f.R;

  f.dmean = skew(f.mean) * f.delta - f.gamma;
  f.dmean.middleCols<3>(JointLayout::kMean) += W;

  // d(R^T C R) = R^T dC R + M [delta]x - [delta]x M.
  const Eigen::Matrix3d& M = f.M;
  const auto dx = f.delta.row(0), dy = f.delta.row(1), dz = f.delta.row(2);
  f.dxx = 2.0 * (M(0, 1) * dz - M(0, 2) * dy);
  f.dyy = 2.0 * (M(1, 2) * dx - M(0, 1) * dz);
  f.dxy = M(0, 2) * dx - M(1, 2) * dy + (M(1, 1) - M(0, 0)) * dz;
  for (int e = 0; e < symmetric::kSize; ++e) {
    const int i = symmetric::kRow[e], j = symmetric::kColumn[e];
    const int column = JointLayout::kScatter + e;
    const double twice = i == j ? 1.0 : 2.0;
    f.dxx[column] += twice * W(0, i) * W(0, j);
    f.dyy[column] += twice * W(1, i) * W(1, j);
    f.dxy[column] += W(0, i) * W(1, j) + (i == j ? 0.0 : W(0, j) * W(1, i));
  }
  return f;
}

// Moves the centre to R (mean_x, mean_y or 0, 0) + c: eq. of c' in II-6 and II-9.
void
recentre(MomentFrame& f, bool along_y)
{
  const Eigen::Vector3d shift(f.mean.x(), along_y ? f.mean.y() : 0.0, 0.0);
  f.c += f.R * shift;
  f.gamma -= skew(shift) * f.delta;
  const int rows = along_y ? 2 : 1;
  f.gamma.topRows(rows) += f.dmean.topRows(rows);
  f.dmean.topRows(rows).setZero();
  f.mean -= shift;
}

// The frame turned about z to x' = cos x + sin y.
Eigen::Matrix3d
turnedAboutZ(const Eigen::Matrix3d& R, double cosine, double sine)
{
  Eigen::Matrix3d turned = R;
  turned.col(0) = cosine * R.col(0) + sine * R.col(1);
  turned.col(1) = cosine * R.col(1) - sine * R.col(0);
  return turned;
}

// x axis with non-negative world x component (ties: y, then z).
Eigen::Matrix3d
canonicalAxes(const Eigen::Matrix3d& R)
{
  constexpr double kTie = 1e-12;
  const Eigen::Vector3d x = R.col(0);
  const double decisive = std::abs(x[0]) > kTie ? x[0] :
                          std::abs(x[1]) > kTie ? x[1] :
                                                  x[2];
  return decisive < 0.0 ? turnedAboutZ(R, -1.0, 0.0) : R;
}

// The frame of a revolute type, R = Exp([rx ry 0]) with the same z; its twist about z
// follows from r_z = 0. r_xy is off the chart's singularity (regularRxyFromNormal).
// \return d r_xy
Rows2
orientRevolute(const Eigen::Vector2d& r_xy, Placement& p)
{
  Eigen::Matrix2d J = Eigen::Matrix2d::Identity();
  rxyJacobian(r_xy, J);
  const Rows2 dr = J * p.delta.topRows<2>();
  const Eigen::Matrix3d Jr = rightJacobian({r_xy.x(), r_xy.y(), 0.0});
  p.delta.row(2) = Jr.block<1, 2>(2, 0) * dr;
  return dr;
}

// A symmetric matrix in the tangent plane, curvatures or moments, with its rows.
struct PlaneMatrix {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  Row dxx = Row::Zero(), dxy = Row::Zero(), dyy = Row::Zero();
};

PlaneMatrix
curvatureMap(const Eigen::Vector3d& k, const Eigen::Matrix3d& W)
{
  PlaneMatrix map;
  const Eigen::Matrix3d T = symmetric::planeTurn(W.topLeftCorner<2, 2>());
  const Eigen::Vector3d turned = T * k;
  map.xx = turned[0], map.xy = turned[1], map.yy = turned[2];
  map.dxx.head<3>() = T.row(0);
  map.dxy.head<3>() = T.row(1);
  map.dyy.head<3>() = T.row(2);
  return map;
}

// Principal axes of the curvatures, |kappa_x| <= |kappa_y|, canonical x axis.
Eigen::Matrix3d
principalCurvatureAxes(const UnboundedSurface& surface)
{
  const Eigen::Vector3d& k = surface.k;
  const double angle = 0.5 * std::atan2(2.0 * k[1], k[0] - k[2]);
  const double mean = 0.5 * (k[0] + k[2]);
  Eigen::Matrix3d R = turnedAboutZ(surface.R, std::cos(angle), std::sin(angle));
  // The angle leads to the algebraically larger curvature, which has the larger
  // magnitude when the mean is positive.
  if (mean > 0.0)
    R = turnedAboutZ(R, 0.0, 1.0);
  return canonicalAxes(R);
}

// The placement turned to the axes R, and its moments there. `twist` may complete the
// rows of the placement, then in those axes; W: to them from those of the surface.
template <typename Twist>
MomentFrame
turnedFrame(const BoundRequest& request,
            Placement p,
            const Eigen::Matrix3d& R,
            Twist&& twist)
{
  const Eigen::Matrix3d W = R.transpose() * request.surface.R;
  p.R = R;
  p.delta = (W * p.delta).eval();
  p.gamma = (W * p.gamma).eval();
  twist(p, W);
  return measureMoments(p, request.scatter, W);
}

MomentFrame
turnedFrame(const BoundRequest& request, const Placement& p, const Eigen::Matrix3d& R)
{
  return turnedFrame(request, p, R, [](Placement&, const Eigen::Matrix3d&) {});
}

// Fills a bounded patch: value and Jacobian rows group by group.
class PatchWriter {
public:
  PatchWriter(PatchType type, BoundedPatch& out) : out_(out), layout_(layoutOf(type))
  {
    out.patch.type = type;
    out.jacobian.setZero(layout_.size(), JointLayout::kSize);
  }

  void bound(int i, double value, const Row& row)
  {
    if (!(value > 0.0) || !std::isfinite(value))
      out_.status = FitStatus::Degenerate;
    out_.patch.d[i] = value;
    out_.jacobian.row(i) = row;
  }

  // d = factor sqrt(moment).
  void boundFromMoment(int i, double factor, double moment, const Row& dmoment)
  {
    const double d = factor * std::sqrt(std::max(moment, 0.0));
    bound(i,
          d,
          d > 0.0 ? Row(factor * factor / (2.0 * d) * dmoment) : Row(Row::Zero()));
  }

  void curvature(int i, double value, const Row& row)
  {
    if (value == 0.0)
      out_.status = FitStatus::Degenerate;
    out_.patch.kappa[i] = value;
    out_.jacobian.row(layout_.k() + i) = row;
  }

  void pose(const MomentFrame& f, const Eigen::Vector3d& origin)
  {
    out_.patch.r = logMap(f.R);
    out_.jacobian.middleRows<3>(layout_.r()) =
        rightJacobianInverse(out_.patch.r) * f.delta;
    centre(f, origin);
  }

  // dr as from orientRevolute().
  void revolutePose(const MomentFrame& f,
                    const Eigen::Vector2d& r_xy,
                    const Rows2& dr,
                    const Eigen::Vector3d& origin)
  {
    out_.patch.r << r_xy, 0.0;
    out_.jacobian.middleRows<2>(layout_.r()) = dr;
    centre(f, origin);
  }

private:
  void centre(const MomentFrame& f, const Eigen::Vector3d& origin)
  {
    out_.patch.c = origin + f.c;
    out_.jacobian.middleRows<3>(layout_.c()) = f.R * f.gamma;
  }

  BoundedPatch& out_;
  ParameterLayout layout_;
};

// Second moments about the centre, v_x and v_y of eq. (10) with its missing 1/N.
struct SecondMoments {
  double x, y;
  Row dx, dy;
};

SecondMoments
secondMoments(const MomentFrame& f)
{
  return {f.M(0, 0) + f.mean.x() * f.mean.x(),
          f.M(1, 1) + f.mean.y() * f.mean.y(),
          f.dxx + 2.0 * f.mean.x() * f.dmean.row(0),
          f.dyy + 2.0 * f.mean.y() * f.dmean.row(1)};
}

// II-7 and II-9, circle: radius from the mean of the moments, or the paper's max.
void
writeCircle(PatchWriter& writer,
            double x,
            double y,
            const Row& dx,
            const Row& dy,
            double factor,
            bool smooth)
{
  if (smooth)
    writer.boundFromMoment(0, factor, 0.5 * (x + y), 0.5 * (dx + dy));
  else
    writer.boundFromMoment(0, factor, std::max(x, y), x > y ? dx : dy);
}

// II-8, and II-6 for the cylindric paraboloid.
BoundedPatch
boundTwoCurvatures(const BoundRequest& request,
                   const BoundSettings& settings,
                   const Placement& placed)
{
  BoundedPatch out;
  PatchWriter writer(request.type, out);
  const UnboundedSurface& surface = request.surface;
  const SurfaceType type = request.type.surface;
  PlaneMatrix K;
  MomentFrame f = turnedFrame(request,
                              placed,
                              principalCurvatureAxes(surface),
                              [&](Placement& p, const Eigen::Matrix3d& W) {
                                K = curvatureMap(surface.k, W);
                                const double scale =
                                    std::max(std::abs(K.xx), std::abs(K.yy));
                                p.delta.row(2) = K.dxy / safeGap(K.xx - K.yy, scale);
                              });
  if (type == SurfaceType::CylindricParaboloid) { // II-6
    recentre(f, false);
    writer.curvature(0, K.yy, K.dyy);
  }
  else {
    writer.curvature(0, K.xx, K.dxx);
    writer.curvature(1, K.yy, K.dyy);
    const bool opposite = K.xx * K.yy < 0.0;
    if (opposite != (type == SurfaceType::HyperbolicParaboloid))
      out.status = FitStatus::CurvatureSignMismatch;
  }
  const SecondMoments v = secondMoments(f);
  writer.boundFromMoment(0, settings.factors.lambda, v.x, v.dx);
  writer.boundFromMoment(1, settings.factors.lambda, v.y, v.dy);
  writer.pose(f, request.origin);
  return out;
}

// The curvature of a type that has one all around.
void
writeOneCurvature(PatchWriter& writer, const UnboundedSurface& surface)
{
  const Eigen::Vector3d shares =
      withModel(surface.model, [](auto m) { return m.curvatureShares(); });
  Row dk = Row::Zero();
  dk.head<3>() = shares;
  writer.curvature(0, shares[0] * surface.k[0] + shares[2] * surface.k[2], dk);
}

// II-7.
BoundedPatch
boundRevolute(const BoundRequest& request,
              const BoundSettings& settings,
              const Placement& placed)
{
  BoundedPatch out;
  PatchWriter writer(request.type, out);
  const UnboundedSurface& surface = request.surface;
  const Eigen::Vector2d r_xy = regularRxyFromNormal(placed.z);
  Rows2 dr;
  const MomentFrame f = turnedFrame(
      request,
      placed,
      expMap({r_xy.x(), r_xy.y(), 0.0}),
      [&](Placement& p, const Eigen::Matrix3d&) { dr = orientRevolute(r_xy, p); });
  writeOneCurvature(writer, surface);
  const SecondMoments v = secondMoments(f);
  writeCircle(writer,
              v.x,
              v.y,
              v.dx,
              v.dy,
              settings.factors.lambda,
              settings.smooth_circle_radius);
  writer.revolutePose(f, r_xy, dr, request.origin);
  return out;
}

// II-6 for the circular cylinder.
BoundedPatch
boundCylinder(const BoundRequest& request,
              const BoundSettings& settings,
              const Placement& placed)
{
  BoundedPatch out;
  PatchWriter writer(request.type, out);
  MomentFrame f = turnedFrame(request, placed, canonicalAxes(placed.R));
  recentre(f, false);
  writeOneCurvature(writer, request.surface);
  const SecondMoments v = secondMoments(f);
  writer.boundFromMoment(0, settings.factors.lambda, v.x, v.dx);
  writer.boundFromMoment(1, settings.factors.lambda, v.y, v.dy);
  writer.pose(f, request.origin);
  return out;
}

// Principal axes of the in-plane scatter, t = atan2(beta, alpha - phi)/2 of II-9.
Eigen::Matrix3d
principalScatterAxes(const Eigen::Matrix3d& R, const Scatter& scatter)
{
  const Eigen::Matrix3d M = R.transpose() * scatter.covariance * R;
  const double t = 0.5 * std::atan2(2.0 * M(0, 1), M(0, 0) - M(1, 1));
  return canonicalAxes(turnedAboutZ(R, std::cos(t), std::sin(t)));
}

// II-9, circle.
BoundedPatch
boundPlaneCircle(const BoundRequest& request,
                 const BoundSettings& settings,
                 const Placement& placed)
{
  BoundedPatch out;
  PatchWriter writer(request.type, out);
  const UnboundedSurface& surface = request.surface;
  const Eigen::Vector2d r_xy = regularRxyFromNormal(surface.R.col(2));
  // The larger moment is that of the principal axes; the sum is the same in any.
  MomentFrame f =
      turnedFrame(request, placed, principalScatterAxes(surface.R, request.scatter));
  recentre(f, true);
  const double scale = std::sqrt(2.0); // l = sqrt(-ln(1-Gamma)) sqrt(2 x moment)
  writeCircle(writer,
              f.M(0, 0),
              f.M(1, 1),
              f.dxx,
              f.dyy,
              scale * settings.factors.plane,
              settings.smooth_circle_radius);

  Placement revolute{expMap({r_xy.x(), r_xy.y(), 0.0}), f.c, surface.R.col(2)};
  revolute.delta = revolute.R.transpose() * f.R * f.delta;
  writer.revolutePose(f, r_xy, orientRevolute(r_xy, revolute), request.origin);
  return out;
}

// II-9: ellipse, rectangle and convex quad from l+ and l-, paper eqs. (15) and (17).
// In the principal axes alpha = M_xx, phi = M_yy, beta = 0, and l+-^2 = 2 (alpha, phi)
// times -ln(1 - Gamma).
BoundedPatch
boundPlane(const BoundRequest& request,
           const BoundSettings& settings,
           const Placement& placed)
{
  BoundedPatch out;
  PatchWriter writer(request.type, out);
  const Scatter& scatter = request.scatter;
  MomentFrame f = turnedFrame(request,
                              placed,
                              principalScatterAxes(request.surface.R, scatter),
                              [&](Placement& p, const Eigen::Matrix3d& W) {
                                // dt = ((alpha - phi) dbeta - beta (dalpha - dphi)) /
                                // (2 D) at beta = 0.
                                const MomentFrame untwisted =
                                    measureMoments(p, scatter, W);
                                const Eigen::Matrix3d& M = untwisted.M;
                                p.delta.row(2) +=
                                    untwisted.dxy / safeGap(M(0, 0) - M(1, 1), M(0, 0));
                              });
  recentre(f, true);
  const double scale = std::sqrt(2.0) * settings.factors.plane;
  if (request.type.boundary != BoundaryType::Quad) {
    writer.boundFromMoment(0, scale, f.M(0, 0), f.dxx);
    writer.boundFromMoment(1, scale, f.M(1, 1), f.dyy);
  }
  else {
    // |l|^2 = scale^2 (alpha + phi), gamma = atan2(l-, l+).
    const double alpha = std::max(f.M(0, 0), 0.0), phi = std::max(f.M(1, 1), 0.0);
    for (int i = 0; i < 4; ++i)
      writer.boundFromMoment(i, scale, alpha + phi, f.dxx + f.dyy);
    const double sum = std::sqrt(alpha * phi) * (alpha + phi);
    const Row dgamma =
        sum > 0.0 ? Row((alpha * f.dyy - phi * f.dxx) / (2.0 * sum)) : Row(Row::Zero());
    writer.bound(4, std::atan2(std::sqrt(phi), std::sqrt(alpha)), dgamma);
  }
  writer.pose(f, request.origin);
  return out;
}

BoundedPatch
boundPlaced(const BoundRequest& request,
            const BoundSettings& settings,
            const Placement& placed)
{
  const bool flat = curvatureParameterCount(request.type.surface) == 0;
  if (isRevolute(request.type))
    return flat ? boundPlaneCircle(request, settings, placed) :
                  boundRevolute(request, settings, placed);
  if (flat)
    return boundPlane(request, settings, placed);
  return isParaboloid(request.type.surface) ?
             boundTwoCurvatures(request, settings, placed) :
             boundCylinder(request, settings, placed);
}

// The curvature matrix in the axes of the placement, with its rows.
PlaneMatrix
placedCurvature(const UnboundedSurface& surface)
{
  PlaneMatrix map;
  const Eigen::Matrix3d shares =
      withModel(surface.model, [](auto m) { return m.curvatureMatrix(); });
  const Eigen::Vector3d entries = shares * surface.k;
  map.xx = entries[0], map.xy = entries[1], map.yy = entries[2];
  map.dxx.head<3>() = shares.row(0);
  map.dxy.head<3>() = shares.row(1);
  map.dyy.head<3>() = shares.row(2);
  return map;
}

// K as a frame sees it that does not share the twist of the surface about its normal.
void
untwist(PlaneMatrix& K, const Row& twist)
{
  K.dxx -= 2.0 * K.xy * twist;
  K.dyy += 2.0 * K.xy * twist;
  K.dxy += (K.xx - K.yy) * twist;
}

// A symmetric matrix and its rows in axes turned by V, from the old to the new: about
// the normal, or a matrix that is the same in all axes.
PlaneMatrix
turnedMap(const PlaneMatrix& map, const Eigen::Matrix3d& V)
{
  const Eigen::Matrix3d T = symmetric::planeTurn(std::atan2(V(0, 1), V(0, 0)));
  const Eigen::Vector3d entries = T * Eigen::Vector3d(map.xx, map.xy, map.yy);
  Rows3 rows;
  rows << map.dxx, map.dxy, map.dyy;
  rows = (T * rows).eval();
  return {entries[0], entries[1], entries[2], rows.row(0), rows.row(1), rows.row(2)};
}

// Group of a state: one mean, or all three entries.
void
writeGroup(int at, int count, const PlaneMatrix& map, PatchJacobian& jacobian)
{
  if (count == 1) {
    jacobian.row(at) = 0.5 * (map.dxx + map.dyy);
  }
  else if (count == 3) {
    jacobian.row(at) = map.dxx;
    jacobian.row(at + 1) = map.dxy;
    jacobian.row(at + 2) = map.dyy;
  }
}

// Second moments about the centre of the patch.
PlaneMatrix
momentsAboutCentre(const MomentFrame& f)
{
  const double x = f.mean.x(), y = f.mean.y();
  PlaneMatrix m;
  m.xx = f.M(0, 0) + x * x, m.xy = f.M(0, 1) + x * y, m.yy = f.M(1, 1) + y * y;
  m.dxx = f.dxx + 2.0 * x * f.dmean.row(0);
  m.dyy = f.dyy + 2.0 * y * f.dmean.row(1);
  m.dxy = f.dxy + x * f.dmean.row(1) + y * f.dmean.row(0);
  return m;
}

// The paper's radius of round bounds is that of the larger moment (smooth: the mean of
// both); so is the state's then, in the axes of the bound.
void
keepLarger(const BoundedPatch& bounded, double factor, PlaneMatrix& m)
{
  const double d = bounded.patch.d[0];
  m.xx = m.yy = d * d / (factor * factor);
  m.dxx = m.dyy = 2.0 * d / (factor * factor) * bounded.jacobian.row(0);
}

// The state, about the centre of the bounded patch. Its frame turns with the normal and
// does not twist about it.
void
writeState(const BoundRequest& request,
           const BoundSettings& settings,
           const Placement& placed,
           BoundedPatch& out)
{
  PatchState& state = out.state;
  state.type = request.type;
  state.normal = placed.z;
  state.centre = out.patch.c;
  const Eigen::Matrix3d frame = state.frame();
  const Eigen::Matrix3d W = frame.transpose() * request.surface.R;
  const int c = layoutOf(request.type).c();
  Placement p{frame, out.patch.c - request.origin, placed.z};
  p.delta = W * placed.delta;
  p.gamma = frame.transpose() * out.jacobian.middleRows<3>(c);
  PlaneMatrix K = placedCurvature(request.surface);
  untwist(K, p.delta.row(2));
  p.delta.row(2).setZero();
  K = turnedMap(K, frame.transpose() * placed.R);
  PlaneMatrix m = momentsAboutCentre(measureMoments(p, request.scatter, W));
  const bool flat = curvatureParameterCount(request.type.surface) == 0;
  if (isRevolute(request.type) && !settings.smooth_circle_radius)
    keepLarger(out,
               flat ? std::sqrt(2.0) * settings.factors.plane : settings.factors.lambda,
               m);
  state.moments << m.xx, m.xy, m.yy;
  if (!flat)
    state.curvature << K.xx, K.xy, K.yy;
  const StateLayout layout = stateLayoutOf(request.type);
  PatchJacobian& jacobian = out.state_jacobian;
  jacobian.resize(layout.size(), JointLayout::kSize);
  writeGroup(0, layout.m_count, m, jacobian);
  writeGroup(layout.k(), layout.k_count, K, jacobian);
  jacobian.middleRows<2>(layout.nu()) = p.delta.topRows<2>();
  jacobian.bottomRows<3>() = out.jacobian.middleRows<3>(c);
}

} // namespace

ContainmentFactors
ContainmentFactors::of(double containment)
{
  return {std::sqrt(2.0) * boost::math::erf_inv(containment),
          std::sqrt(-std::log1p(-containment))};
}

BoundedPatch
boundPatch(const BoundRequest& request, const BoundSettings& settings)
{
  const std::optional<Placement> placed = withModel(request.surface.model, [&](auto m) {
    return m.place({request.surface,
                    request.scatter,
                    request.plane,
                    settings.centre_on_normal_line});
  });
  if (!placed) {
    BoundedPatch out;
    PatchWriter(request.type, out);
    out.status = FitStatus::Degenerate;
    return out;
  }
  BoundedPatch out = boundPlaced(request, settings, *placed);
  writeState(request, settings, *placed, out);
  return out;
}

} // namespace holdfast
