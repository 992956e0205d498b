// The stages of the paper's section III, one function each: value and Jacobian. Vectors
// are in the paper's order; a rotation is r or, for types with revolute symmetry, r_xy.
#pragma once

#include "fit/fit_patch.h"
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/pose.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Core>

namespace holdfast { namespace stagewise {

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int M, int N>
using Mat = Eigen::Matrix<double, M, N>;

// What a stage hands to the next.
template <int N>
struct Estimate {
  Vec<N> mean;
  Mat<N, N> covariance;
};

// A stage at one input: output and d output / d input.
template <int M, int N>
struct Stage {
  Vec<M> value;
  Mat<M, N> J;
};

// Large enough for every stage: one type, so that the products are compiled once.
using Bounded = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 16, 16>;

// Sigma <- J Sigma J^T.
// \param f a stage as a function of its input.
template <typename F, int N>
auto
propagated(const F& f, const Estimate<N>& input)
{
  const auto stage = f(input.mean);
  constexpr int M = decltype(stage.value)::RowsAtCompileTime;
  return Estimate<M>{stage.value,
                     propagate(Bounded(stage.J), Bounded(input.covariance))};
}

// Two estimates put together as if independent: where the paper drops a correlation.
template <int M, int N>
Estimate<M + N>
independent(const Estimate<M>& a, const Estimate<N>& b)
{
  Estimate<M + N> both{Vec<M + N>::Zero(), Mat<M + N, M + N>::Zero()};
  both.mean << a.mean, b.mean;
  both.covariance.template topLeftCorner<M, M>() = a.covariance;
  both.covariance.template bottomRightCorner<N, N>() = b.covariance;
  return both;
}

// r_xy of the frame R0 R(r), as a function of r.
Stage<2, 3> revoluteRotation(const Eigen::Matrix3d& R0, const Eigen::Vector3d& r);

// The frame turned about its z axis by an angle, r' = log(R(r) R_z(angle)).
Stage<3, 3> turnedRotation(const Eigen::Vector3d& r, double angle);

// r or r_xy as exponential coordinates.
template <int NR>
Eigen::Vector3d
rotationOf(const Vec<NR>& r)
{
  Eigen::Vector3d full = Eigen::Vector3d::Zero();
  full.head<NR>() = r;
  return full;
}

// ---- Stage I-1 ----

// The weighted fit's parameters theta = (delta_x, delta_y, c_z) about the given plane
// -> [r_xy c].
Stage<5, 3> planeFromTheta(const Pose& plane, const Vec<3>& theta);

// The scatter's principal normal: entries xx xy xz yy yz zz of C -> r_xy.
// \param towards the side to which the normal points.
Stage<2, 6> principalNormal(const Eigen::Vector3d& towards, const Vec<6>& C);

// r_xy -> z = R(r) (0, 0, 1).
Stage<3, 2> normalVector(const Vec<2>& r_xy);

// Eq. (3): [qbar r_xy c] -> [r_xy c'].
Stage<5, 8> projectedCentre(const Vec<8>& x);

// ---- Stage I-2, in the axes of the fitted surface ----

// theta = (kxx, kxy, kyy, delta_x, delta_y, a) about a = 0 -> [K r c].
// \param line unit direction of the centre's line.
Stage<9, 6> paraboloidFromTheta(const Eigen::Vector3d& line, const Vec<6>& theta);

// theta = (k, c) -> [k C], C the centre of the sphere.
Stage<4, 4> sphereFromTheta(const Vec<4>& theta);

// Eq. (4): [r'_xy k C] -> [k r'_xy c].
Stage<6, 6> sphereApex(const Vec<6>& x);

// theta = (k, delta_y, delta_z, c_y, c_z) about zero deltas -> [x k C], x the direction
// of the axis and C a point on it.
// \param sense +1 or -1: which way x points along the local x axis.
Stage<7, 5> cylinderFromTheta(double sense, const Vec<5>& theta);

// Eq. (5): [z x k C] -> [k r' c].
Stage<7, 10> cylinderApex(const Vec<10>& x);

// ---- Stage I-3 ----

// Eq. (6): [K r c] -> [r_xy c].
Stage<5, 9> planeFromParaboloid(const Vec<9>& x);

// [K r c] -> [kappa_x kappa_y r c] in principal axes, kappa_x >= kappa_y.
Stage<8, 9> principalCurvatures(const Vec<9>& x);

// Eq. (7): [kappa_x kappa_y r c] -> [kappa_y r c].
Stage<7, 8> cylindricCurvature(const Vec<8>& x);

// Eq. (8) before (7) is applied: x' = y, y' = -x.
Stage<8, 8> swappedAxes(const Vec<8>& x);

// x' = -x, y' = -y: the canonical sense of the axes.
Stage<8, 8> reversedAxes(const Vec<8>& x);

// Eq. (9): [K r c] -> [kappa r_xy c].
Stage<6, 9> circularFromParaboloid(const Vec<9>& x);

// ---- Stage II-5 ----

// Eq. (10): the moments m = (xbar, ybar, v_x, v_y, v_xy) of the points in the frame
// (r, c) -> [m], as a function of (r, c).
// \param scatter in the axes that r and c refer to.
Stage<5, 6> moments(const Scatter& scatter, const Vec<6>& pose);

// dm/dq_i of eq. (11) for a point (x, y) of `count`, with respect to its local x and y.
Mat<5, 2> momentsByPoint(double x, double y, int count);

// Eq. (11) without the points: [k r c] -> [m k r c].
template <int NK, int NR>
Stage<NK + NR + 8, NK + NR + 3>
momentsAndSurface(const Scatter& scatter, const Vec<NK + NR + 3>& x)
{
  Vec<6> pose;
  pose << rotationOf<NR>(x.template segment<NR>(NK)), x.template tail<3>();
  const Stage<5, 6> m = moments(scatter, pose);
  Stage<NK + NR + 8, NK + NR + 3> out;
  out.value << m.value, x;
  out.J.setZero();
  out.J.template block<5, NR>(0, NK) = m.J.leftCols<NR>();
  out.J.template block<5, 3>(0, NK + NR) = m.J.rightCols<3>();
  out.J.template bottomRows<NK + NR + 3>().setIdentity();
  return out;
}

// ---- Stages II-6 to II-9 ----

// Eq. (12): [m k r c] -> [d_r k r c'].
Stage<9, 12> cylinderBound(double lambda, const Vec<12>& x);

// Eq. (13): [m k r_xy c] -> [d_c k r_xy c].
// \param smooth radius from the mean of the two moments, not from the larger one.
Stage<7, 11> circleBound(double lambda, bool smooth, const Vec<11>& x);

// Eq. (14): [m kappa_x kappa_y r c] -> [d_e kappa_x kappa_y r c].
Stage<10, 13> ellipseBound(double lambda, const Vec<13>& x);

// Eq. (15): [m r_xy c] -> [l rho r_xy c'], l = (l+, l-), rho = (alpha, beta, phi).
// \param factor sqrt(-ln(1 - Gamma))
Stage<10, 10> planeAxes(double factor, const Vec<10>& x);

// Eq. (16): [l rho r_xy c'] -> [d_c r_xy c'].
// \param smooth radius from alpha + phi, not from l+.
Stage<6, 10> planeCircle(double factor, bool smooth, const Vec<10>& x);

// Eq. (17): [l rho r_xy c'] -> [d r c'], ellipse and rectangle.
// \param reversed x along the negative major axis.
Stage<8, 10> planeEllipse(bool reversed, const Vec<10>& x);

// Eq. (17), convex quad.
Stage<11, 10> planeQuad(bool reversed, const Vec<10>& x);

// ---- The chain ----

// [d k r c] of a patch, its pose carried along by a change of frame; ND bounds and
// curvatures together.
template <int ND, int NR>
Stage<ND + NR + 3, ND + NR + 3>
movedPatch(const Pose& to_world, const Vec<ND + NR + 3>& x)
{
  const Eigen::Vector3d r = rotationOf<NR>(x.template segment<NR>(ND));
  Stage<ND + NR + 3, ND + NR + 3> out;
  out.value = x;
  out.J.setIdentity();
  if constexpr (NR == 2) {
    const Stage<2, 3> r_xy = revoluteRotation(to_world.R, r);
    out.value.template segment<2>(ND) = r_xy.value;
    out.J.template block<2, 2>(ND, ND) = r_xy.J.leftCols<2>();
  }
  else {
    const Eigen::Vector3d moved = logMap(to_world.R * expMap(r));
    out.value.template segment<3>(ND) = moved;
    out.J.template block<3, 3>(ND, ND) = rightJacobianInverse(moved) * rightJacobian(r);
  }
  out.value.template tail<3>() = to_world.toWorld(x.template tail<3>());
  out.J.template bottomRightCorner<3, 3>() = to_world.R;
  return out;
}

// Parameters [d | k | r | c] and covariance at the end of the chain.
struct ChainResult {
  ParameterVector mean;
  ParameterMatrix covariance;
};

// The stages in order (paper Fig. 4), for a converged fit.
ChainResult runChain(const PatchFit& fit,
                     const PointBatch& batch,
                     const FitOptions& options);

}} // namespace holdfast::stagewise
