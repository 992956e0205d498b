#include "boundary_fit.h"

#include "fit/models/models.h"
#include "geometry/safe_gap.h"
#include "geometry/symmetric.h"
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <cmath>
#include <optional>

namespace holdfast {
namespace {

using Row = JointRow;
using Rows2 = JointRows2;
using Rows3 = JointRows3;

// A symmetric matrix in the tangent plane, curvatures or moments, with its rows.
struct PlaneMatrix {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  Row dxx = Row::Zero(), dxy = Row::Zero(), dyy = Row::Zero();

  Eigen::Vector3d entries() const
  {
    return {xx, xy, yy};
  }
};

// The axes of the patch, as a frame that turns with the normal and does not twist about
// it. Rows are in these axes; gamma = R^T dc.
struct StateFrame {
  Eigen::Matrix3d R;
  Eigen::Vector3d c; // relative to the batch's origin
  Rows3 delta, gamma;
  Row twist; // of the placement against this frame
};

StateFrame
stateFrame(const Eigen::Matrix3d& axes,
           const BoundRequest& request,
           const SurfacePlacement& placed)
{
  StateFrame f{axes, placed.c, {}, {}, {}};
  const Eigen::Matrix3d W = f.R.transpose() * request.surface.R;
  f.delta = W * placed.delta;
  f.gamma = W * placed.gamma;
  f.twist = f.delta.row(2);
  f.delta.row(2).setZero();
  return f;
}

// A symmetric matrix and its rows in axes turned about the normal by V, from the old to
// the new.
PlaneMatrix
turnedMap(const PlaneMatrix& map, const Eigen::Matrix3d& V)
{
  const Eigen::Matrix3d T = symmetric::planeTurn(V(0, 0), V(0, 1));
  const Eigen::Vector3d entries = T * map.entries();
  Rows3 rows;
  rows << map.dxx, map.dxy, map.dyy;
  rows = (T * rows).eval();
  return {entries[0], entries[1], entries[2], rows.row(0), rows.row(1), rows.row(2)};
}

// The matrix as axes see it that turn by `turn` about the normal besides.
void
addTurnOfAxes(const Row& turn, PlaneMatrix& m)
{
  m.dxx += 2.0 * m.xy * turn;
  m.dyy -= 2.0 * m.xy * turn;
  m.dxy -= (m.xx - m.yy) * turn;
}

Eigen::Matrix3d
curvatureShares(const UnboundedSurface& surface)
{
  return withModel(surface.model, [](auto m) { return m.curvatureMatrix(); });
}

// The principal axes of the curvatures, of planes those of the points.
Eigen::Matrix3d
axesOfPatch(const BoundRequest& request, const SurfacePlacement& placed)
{
  PatchState state;
  state.type = request.type;
  state.normal = placed.z;
  const Eigen::Matrix3d frame = state.frame();
  if (request.type.surface == SurfaceType::Plane) {
    const Eigen::Matrix3d C = frame.transpose() * request.scatter.covariance * frame;
    state.moments << C(0, 0), C(0, 1), C(1, 1);
  }
  else {
    const Eigen::Matrix3d W = frame.transpose() * placed.R;
    state.curvature = symmetric::planeTurn(W(0, 0), W(0, 1)) *
                      (curvatureShares(request.surface) * request.surface.k);
  }
  return axesOf(state).R;
}

// The curvature matrix of the surface.
PlaneMatrix
curvatureIn(const StateFrame& f,
            const UnboundedSurface& surface,
            const SurfacePlacement& placed)
{
  PlaneMatrix K;
  const Eigen::Matrix3d shares = curvatureShares(surface);
  const Eigen::Vector3d entries = shares * surface.k;
  K.xx = entries[0], K.xy = entries[1], K.yy = entries[2];
  K.dxx.head<3>() = shares.row(0);
  K.dxy.head<3>() = shares.row(1);
  K.dyy.head<3>() = shares.row(2);
  addTurnOfAxes(-f.twist, K);
  return turnedMap(K, f.R.transpose() * placed.R);
}

// Moments of the points in a frame.
struct Moments {
  Eigen::Vector3d mean; // R^T (qbar - c)
  Rows3 dmean;
  PlaneMatrix M; // R^T C R about the mean
};

Moments
measureMoments(const StateFrame& f, const BoundRequest& request)
{
  const Scatter& scatter = request.scatter;
  const Eigen::Matrix3d W = f.R.transpose() * request.surface.R;
  Moments m;
  m.mean = f.R.transpose() * (scatter.mean - f.c);
  m.dmean = skew(m.mean) * f.delta - f.gamma;
  m.dmean.middleCols<3>(JointLayout::kMean) += W;

  // d(R^T C R) = R^T dC R + M [delta]x - [delta]x M, without delta_z.
  const Eigen::Matrix3d C = f.R.transpose() * scatter.covariance * f.R;
  const auto dx = f.delta.row(0), dy = f.delta.row(1);
  PlaneMatrix& M = m.M;
  M.xx = C(0, 0), M.xy = C(0, 1), M.yy = C(1, 1);
  M.dxx = -2.0 * C(0, 2) * dy;
  M.dyy = 2.0 * C(1, 2) * dx;
  M.dxy = C(0, 2) * dx - C(1, 2) * dy;
  for (int e = 0; e < symmetric::kSize; ++e) {
    const int i = symmetric::kRow[e], j = symmetric::kColumn[e];
    const int column = JointLayout::kScatter + e;
    const double twice = i == j ? 1.0 : 2.0;
    M.dxx[column] += twice * W(0, i) * W(0, j);
    M.dyy[column] += twice * W(1, i) * W(1, j);
    M.dxy[column] += W(0, i) * W(1, j) + (i == j ? 0.0 : W(0, j) * W(1, i));
  }
  return m;
}

// Moves the centre by `shift` in the axes of the frame; dshift: how that itself moves.
void
moveCentre(const Eigen::Vector3d& shift, const Rows3& dshift, StateFrame& f, Moments& m)
{
  f.c += f.R * shift;
  f.gamma += dshift - skew(shift) * f.delta;
  m.mean -= shift;
  m.dmean -= dshift;
}

// c' of II-9: below the mean of the points.
void
centreOnMean(StateFrame& f, Moments& m)
{
  Rows3 dshift = m.dmean;
  dshift.row(2).setZero();
  moveCentre({m.mean.x(), m.mean.y(), 0.0}, dshift, f, m);
}

// c' of II-6: below the mean of the points along x, in which the surface is straight
// and which turns with the curvatures.
void
centreAlongAxis(const PlaneMatrix& K, StateFrame& f, Moments& m)
{
  const double largest = std::max(std::abs(K.xx), std::abs(K.yy));
  const Row turn = K.dxy / safeGap(K.xx - K.yy, largest);
  Rows3 dshift = Rows3::Zero();
  dshift.row(0) = m.dmean.row(0) + m.mean.y() * turn;
  dshift.row(1) = m.mean.x() * turn;
  moveCentre({m.mean.x(), 0.0, 0.0}, dshift, f, m);
}

// Second moments about the centre of the patch, v_x and v_y of eq. (10) with its
// missing 1/N.
PlaneMatrix
momentsAboutCentre(const Moments& m)
{
  const double x = m.mean.x(), y = m.mean.y();
  PlaneMatrix v = m.M;
  v.xx += x * x, v.xy += x * y, v.yy += y * y;
  v.dxx += 2.0 * x * m.dmean.row(0);
  v.dyy += 2.0 * y * m.dmean.row(1);
  v.dxy += x * m.dmean.row(1) + y * m.dmean.row(0);
  return v;
}

// The paper's radius of round bounds is that of the larger moment along the patch's
// axes, of planes along those of the points; so is the state's then.
void
keepLarger(const StateFrame& f, PatchType type, PlaneMatrix& v)
{
  if (type.surface == SurfaceType::Plane) {
    const double angle = 0.5 * std::atan2(2.0 * v.xy, v.xx - v.yy);
    v = turnedMap(v, Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitZ()).matrix());
  }
  else {
    // The frame R = Exp([rx ry 0]) twists about its z so that r_z stays zero.
    const Eigen::Vector2d r_xy = regularRxyFromNormal(f.R.col(2));
    const Eigen::Vector3d r(r_xy.x(), r_xy.y(), 0.0);
    const Eigen::Matrix3d V = expMap(r).transpose() * f.R;
    Eigen::Matrix2d J = Eigen::Matrix2d::Identity();
    rxyJacobian(r_xy, J);
    const Rows2 dr = J * V.topLeftCorner<2, 2>() * f.delta.topRows<2>();
    v = turnedMap(v, V);
    addTurnOfAxes(rightJacobian(r).block<1, 2>(2, 0) * dr, v);
  }
  if (v.xx > v.yy)
    v.yy = v.xx, v.dyy = v.dxx;
  else
    v.xx = v.yy, v.dxx = v.dyy;
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

// The state of the placed surface, in the axes of the patch, with its Jacobian.
void
writeState(const BoundRequest& request,
           const BoundSettings& settings,
           const SurfacePlacement& placed,
           BoundedPatch& out)
{
  StateFrame f = stateFrame(axesOfPatch(request, placed), request, placed);
  const PlaneMatrix K = curvatureIn(f, request.surface, placed);
  const bool flat = request.type.surface == SurfaceType::Plane;
  Moments m = measureMoments(f, request);
  if (flat)
    centreOnMean(f, m);
  else if (traitsOf(request.type.surface).along_x == kStraight)
    centreAlongAxis(K, f, m);
  PlaneMatrix v = momentsAboutCentre(m);
  if (isRevolute(request.type) && !settings.smooth_circle_radius)
    keepLarger(f, request.type, v);

  const StateLayout layout = stateLayoutOf(request.type);
  out.jacobian.resize(layout.size(), JointLayout::kSize);
  writeGroup(0, layout.m_count, v, out.jacobian);
  writeGroup(layout.k(), layout.k_count, K, out.jacobian);
  out.jacobian.middleRows<2>(layout.nu()) = f.delta.topRows<2>();
  out.jacobian.bottomRows<3>() = f.R * f.gamma;
  const Eigen::Vector3d curvature = flat ? Eigen::Vector3d::Zero() : K.entries();
  out.axes = {request.type, f.R, v.entries(), curvature, request.origin + f.c};
}

FitStatus
statusOf(const Patch& patch)
{
  const PatchType type = patch.type;
  const auto bounds = patch.d.head(boundaryParameterCount(type.boundary)).array();
  const auto kappa = patch.kappa.head(curvatureParameterCount(type.surface)).array();
  if (!(bounds > 0.0).all() || !bounds.isFinite().all() || (kappa == 0.0).any())
    return FitStatus::Degenerate;
  const bool opposite = patch.kappa[0] * patch.kappa[1] < 0.0;
  const bool contradicts =
      kappa.size() == 2 &&
      opposite != (type.surface == SurfaceType::HyperbolicParaboloid);
  return contradicts ? FitStatus::CurvatureSignMismatch : FitStatus::Converged;
}

} // namespace

BoundedPatch
boundPatch(const BoundRequest& request, const BoundSettings& settings)
{
  const std::optional<SurfacePlacement> placed =
      withModel(request.surface.model, [&](auto m) {
        return m.place({request.surface,
                        request.scatter,
                        request.plane,
                        settings.centre_on_normal_line});
      });
  BoundedPatch out;
  out.state.type = out.patch.type = request.type;
  if (!placed) {
    out.status = FitStatus::Degenerate;
    return out;
  }
  writeState(request, settings, *placed, out);
  out.squared_bound = request.type.surface == SurfaceType::Plane ?
                          settings.squared_plane_bound :
                          settings.squared_bound;
  out.state = stateIn(out.axes);
  out.patch = patchOf(out.axes, out.squared_bound);
  out.status = statusOf(out.patch);
  return out;
}

} // namespace holdfast
