#include <holdfast/fusion/jet.h>

#include "taylor.h"

#include <holdfast/geometry/gaussian.h>

#include <array>
#include <cmath>

namespace holdfast {
namespace {

/// A vector field over the anchor's plane.
using Field = std::array<Taylor3, 3>;

/// R^T f, or R f, of a field.
Field
turned(const Eigen::Matrix3d& R, const Field& f)
{
  Field result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      result[i] += R(i, j) * f[j];
  return result;
}

/// Component i of a x b.
Taylor3
cross(const Field& a, const Field& b, int i)
{
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  return a[j] * b[k] - a[k] * b[j];
}

/// 2 z = x^T K x in its own frame: f and its gradient there.
struct Paraboloid {
  Eigen::Vector3d k; ///< xx xy yy

  Taylor3 f(const Field& q, const Field& g) const
  {
    return 0.5 * (g[0] * q[0] + g[1] * q[1]) - 2.0 * q[2];
  }
  Field gradient(const Field& q) const
  {
    return {2.0 * (k[0] * q[0] + k[1] * q[1]),
            2.0 * (k[1] * q[0] + k[2] * q[1]),
            Taylor3::affine(-2.0, 0.0, 0.0)};
  }
};

/// z = h(x, y) of a jet in its own anchor, as f = h - z.
struct Graph {
  const JetVector& j;

  Taylor3 f(const Field& q, const Field& /*gradient*/) const
  {
    return Taylor3::affine(j[0], 0.0, 0.0) + j[1] * q[0] + j[2] * q[1] +
           (0.5 * j[3]) * (q[0] * q[0]) + j[4] * (q[0] * q[1]) +
           (0.5 * j[5]) * (q[1] * q[1]) - q[2];
  }
  Field gradient(const Field& q) const
  {
    return {Taylor3::affine(j[1], 0.0, 0.0) + j[3] * q[0] + j[4] * q[1],
            Taylor3::affine(j[2], 0.0, 0.0) + j[4] * q[0] + j[5] * q[1],
            Taylor3::affine(-1.0, 0.0, 0.0)};
  }
};

/// f(q(x, y, h)) = 0 solved for h(x, y).
struct Solution {
  Taylor3 h;
  Field q; ///< the points of the surface, frame of the surface
  Field gradient; ///< of f by q
  Taylor3 slope; ///< -1 / f_h: a parameter p moves h by slope f_p

  ThirdToJet by_third;

  /// Of the best quadric.
  JetVector jetOf(const Taylor3& t) const
  {
    return t.jet() + by_third * t.third();
  }
  JetVector by(const Taylor3& f_p) const
  {
    return jetOf(slope * f_p);
  }
};

/// Newton's steps double the number of right digits: three to four bring the value of h
/// to rounding, three more its derivatives, which lag behind by one each.
/// \param frame of x, y, h in the frame of the surface
template <typename Surface>
std::optional<Solution>
heightsOver(const Surface& surface, const Pose& frame, const ThirdToJet& by_third)
{
  constexpr int kMostSteps = 20, kStepsBehind = 3;
  constexpr double kSmallestCosine = 0.1; // of the surface's normal and the z axis
  Field flat;
  for (int i = 0; i < 3; ++i)
    flat[i] = Taylor3::affine(frame.c[i], frame.R(i, 0), frame.R(i, 1));
  const Eigen::Vector3d z = frame.R.col(2);
  Solution s;
  s.by_third = by_third;
  const auto evaluate = [&] {
    for (int i = 0; i < 3; ++i)
      s.q[i] = flat[i] + z[i] * s.h;
    s.gradient = surface.gradient(s.q);
    const Taylor3 f_h =
        z[0] * s.gradient[0] + z[1] * s.gradient[1] + z[2] * s.gradient[2];
    const double length =
        std::hypot(s.gradient[0].v[0], s.gradient[1].v[0], s.gradient[2].v[0]);
    if (!(std::abs(f_h.v[0]) >= kSmallestCosine * length))
      return false;
    s.slope = -1.0 * reciprocal(f_h);
    return true;
  };
  int steps_left = kStepsBehind;
  for (int step = 0; step < kMostSteps; ++step) {
    if (!evaluate())
      return std::nullopt;
    const Taylor3 change = s.slope * surface.f(s.q, s.gradient);
    s.h += change;
    const double rounding = 1e-14 * (std::abs(s.h.v[0]) + frame.c.norm());
    if (std::abs(change.v[0]) <= rounding && steps_left-- == 0)
      return evaluate() ? std::optional<Solution>(s) : std::nullopt;
  }
  return std::nullopt;
}

/// Coordinates of a surface: kxx kxy kyy, nu_x nu_y, c_x c_y c_z.
constexpr int kSurface = 8;
using BySurface = Eigen::Matrix<double, 6, kSurface>;

/// The coordinates of a surface from those of a state, whose round types have one
/// curvature and whose planes none.
Eigen::Matrix<double, kSurface, Eigen::Dynamic, 0, kSurface, kMaxState>
surfaceByState(PatchType type)
{
  const StateLayout layout = stateLayoutOf(type);
  Eigen::Matrix<double, kSurface, Eigen::Dynamic, 0, kSurface, kMaxState> J;
  J.setZero(kSurface, layout.size());
  if (layout.k_count == 1)
    J(0, layout.k()) = J(2, layout.k()) = 1.0;
  else if (layout.k_count == 3)
    J.block<3, 3>(0, layout.k()).setIdentity();
  J.block<5, 5>(3, layout.nu()).setIdentity();
  return J;
}

BySurface
bySurface(const Solution& s, const Eigen::Matrix3d& R)
{
  BySurface J;
  J.col(0) = s.by(s.q[0] * s.q[0]);
  J.col(1) = s.by(2.0 * (s.q[0] * s.q[1]));
  J.col(2) = s.by(s.q[1] * s.q[1]);
  // R <- R Exp(nu) moves q by q x nu, so f_nu = gradient x q.
  J.col(3) = s.by(cross(s.gradient, s.q, 0));
  J.col(4) = s.by(cross(s.gradient, s.q, 1));
  const Field by_centre = turned(-R, s.gradient);
  for (int i = 0; i < 3; ++i)
    J.col(5 + i) = s.by(by_centre[i]);
  return J;
}

} // namespace

JetVector
jetBasis(double x, double y)
{
  return (JetVector() << 1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y).finished();
}

double
Jet::height(double x, double y) const
{
  return value.dot(jetBasis(x, y));
}

Pose
ownAnchor(const FitResult& fit)
{
  return {fit.state.frame(), fit.state.centre};
}

std::optional<Jet>
jetAt(const FitResult& fit, const Pose& anchor, const ThirdToJet& by_third)
{
  if (!isUsable(fit.status))
    return std::nullopt;
  const Pose own = ownAnchor(fit);
  const auto solved =
      heightsOver(Paraboloid{fit.state.curvature}, own.inverse() * anchor, by_third);
  if (!solved)
    return std::nullopt;
  const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxState> J =
      bySurface(*solved, own.R) * surfaceByState(fit.state.type);
  Jet jet;
  jet.value = solved->jetOf(solved->h);
  const JetMatrix all = symmetrized(J * fit.state_covariance * J.transpose());
  jet.white = all;
  if (fit.white_state_covariance->size() > 0) {
    jet.white = symmetrized(J * *fit.white_state_covariance * J.transpose());
    jet.pattern = all - jet.white;
  }
  return jet;
}

std::optional<MovedJet>
movedJet(const JetVector& jet, const Pose& to, const ThirdToJet& by_third)
{
  const auto solved = heightsOver(Graph{jet}, to, by_third);
  if (!solved)
    return std::nullopt;
  const Solution& s = *solved;
  MovedJet moved;
  moved.value = s.jetOf(s.h);
  const Taylor3 &x = s.q[0], &y = s.q[1];
  moved.by_jet.col(0) = s.jetOf(s.slope);
  moved.by_jet.col(1) = s.by(x);
  moved.by_jet.col(2) = s.by(y);
  moved.by_jet.col(3) = 0.5 * s.by(x * x);
  moved.by_jet.col(4) = s.by(x * y);
  moved.by_jet.col(5) = 0.5 * s.by(y * y);
  // q = R p + t with p = (x, y, h): R <- R Exp(phi) moves q by R (phi x p), so f_phi =
  // p x R^T gradient.
  const Field p = {Taylor3::affine(0.0, 1.0, 0.0), Taylor3::affine(0.0, 0.0, 1.0), s.h};
  const Field local = turned(to.R.transpose(), s.gradient);
  for (int i = 0; i < 3; ++i) {
    moved.by_pose.col(i) = s.by(cross(p, local, i));
    moved.by_pose.col(3 + i) = s.by(s.gradient[i]);
  }
  return moved;
}

std::optional<Jet>
transported(const Jet& jet,
            const Pose& from,
            const Pose& to,
            const ThirdToJet& by_third)
{
  const auto moved = movedJet(jet.value, from.inverse() * to, by_third);
  if (!moved)
    return std::nullopt;
  const JetMatrix& F = moved->by_jet;
  return Jet{moved->value,
             symmetrized(F * jet.white * F.transpose()),
             symmetrized(F * jet.pattern * F.transpose())};
}

JetMatrix
jetByMotion(const JetVector& jet, const Eigen::Vector3d& pivot)
{
  // A point that moves by v lifts the surface by v_z - h_x v_x - h_y v_y; v is linear
  // in (omega, t), and in p = (x, y, h).
  const Taylor3 h = {{jet[0], jet[1], jet[2], 0.5 * jet[3], jet[4], 0.5 * jet[5]}};
  const Taylor3 slope[3] = {Taylor3::affine(-jet[1], -jet[3], -jet[4]),
                            Taylor3::affine(-jet[2], -jet[4], -jet[5]),
                            Taylor3::affine(1.0, 0.0, 0.0)};
  const Field lift = {slope[0], slope[1], slope[2]};
  const Field arm = {Taylor3::affine(-pivot.x(), 1.0, 0.0),
                     Taylor3::affine(-pivot.y(), 0.0, 1.0),
                     h - Taylor3::affine(pivot.z(), 0.0, 0.0)};
  JetMatrix J;
  for (int i = 0; i < 3; ++i) {
    J.col(i) = cross(arm, lift, i).jet();
    J.col(3 + i) = lift[i].jet();
  }
  return J;
}

} // namespace holdfast
