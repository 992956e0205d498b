// Stages II-5 to II-9: the bounds.
#include "uncertainty/stagewise_axes.h"

#include <cmath>

namespace holdfast { namespace stagewise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Positions of the moments in m.
enum Moment { kMeanX, kMeanY, kVx, kVy, kVxy };

// d = factor sqrt(v) with dd/dv; both zero for v <= 0, which no valid bound has.
struct Bound {
  double d = 0.0, dv = 0.0;

  Bound(double factor, double v)
  {
    if (v > 0.0) {
      d = factor * std::sqrt(v);
      dv = 0.5 * d / v;
    }
  }
};

} // namespace

// Paper eq. (10), q' = R^T (q - c). Corrected: the 1/N sums are missing, and v are
// second moments. They are taken from the fit's mean and scatter, so that they are
// those of the patch, debiased or not.
Stage<5, 6>
moments(const Scatter& scatter, const Vec<6>& pose)
{
  const Matrix3d R = expMap(pose.head<3>());
  const Vector3d q = R.transpose() * (scatter.mean - pose.tail<3>());
  const Matrix3d V = R.transpose() * scatter.covariance * R + q * q.transpose();
  Stage<5, 6> out;
  out.value << q.x(), q.y(), V(0, 0), V(1, 1), V(0, 1);
  // With R <- R Exp(delta): dq = q x delta - R^T dc, dV = V [delta]x - [delta]x V - ...
  Mat<5, 3> by_delta, by_centre;
  // clang-format off
  by_delta << 0.0,           -q.z(),          q.y(),
              q.z(),          0.0,           -q.x(),
              0.0,           -2.0 * V(0, 2),  2.0 * V(0, 1),
              2.0 * V(1, 2),  0.0,           -2.0 * V(0, 1),
              V(0, 2),       -V(1, 2),        V(1, 1) - V(0, 0);
  by_centre << -1.0,         0.0,          0.0,
                0.0,        -1.0,          0.0,
               -2.0 * q.x(), 0.0,          0.0,
                0.0,        -2.0 * q.y(),  0.0,
               -q.y(),      -q.x(),        0.0;
  // clang-format on
  out.J << by_delta * rightJacobian(pose.head<3>()), by_centre * R.transpose();
  return out;
}

Mat<5, 2>
momentsByPoint(double x, double y, int count)
{
  Mat<5, 2> J;
  J << 1.0, 0.0, 0.0, 1.0, 2.0 * x, 0.0, 0.0, 2.0 * y, y, x;
  return J / count;
}

// Paper eq. (12), stage II-6: c' = R(r) (xbar, 0, 0) + c and
// d_r = lambda (sqrt(v_x - xbar^2), sqrt(v_y)). Corrected: the result is 9x9.
Stage<9, 12>
cylinderBound(double lambda, const Vec<12>& x)
{
  const Vector3d r = x.segment<3>(6), shift(x[kMeanX], 0.0, 0.0);
  const Matrix3d R = expMap(r);
  const Bound dx(lambda, x[kVx] - x[kMeanX] * x[kMeanX]), dy(lambda, x[kVy]);
  Stage<9, 12> out;
  out.value << dx.d, dy.d, x.segment<4>(5), R * shift + x.tail<3>();
  out.J.setZero();
  out.J(0, kVx) = dx.dv;
  out.J(0, kMeanX) = -2.0 * x[kMeanX] * dx.dv;
  out.J(1, kVy) = dy.dv;
  out.J.block<7, 7>(2, 5).setIdentity();
  out.J.block<3, 1>(6, kMeanX) = R.col(0);
  out.J.block<3, 3>(6, 6) = rotatedVectorJacobian(r, shift);
  return out;
}

// Paper eq. (13), stage II-7: d_c = lambda max(sqrt(v_x), sqrt(v_y)), or the smooth
// lambda sqrt((v_x + v_y)/2). Corrected: the result is 7x7.
Stage<7, 11>
circleBound(double lambda, bool smooth, const Vec<11>& x)
{
  const double vx = x[kVx], vy = x[kVy];
  const double share_x = smooth ? 0.5 : (vx > vy ? 1.0 : 0.0);
  const Bound d(lambda, share_x * vx + (1.0 - share_x) * vy);
  Stage<7, 11> out;
  out.value << d.d, x.tail<6>();
  out.J.setZero();
  out.J(0, kVx) = share_x * d.dv;
  out.J(0, kVy) = (1.0 - share_x) * d.dv;
  out.J.block<6, 6>(1, 5).setIdentity();
  return out;
}

// Paper eq. (14), stage II-8: d_e = lambda (sqrt(v_x), sqrt(v_y)). Corrected: input
// 13x13, J 10x13, result 10x10.
Stage<10, 13>
ellipseBound(double lambda, const Vec<13>& x)
{
  const Bound dx(lambda, x[kVx]), dy(lambda, x[kVy]);
  Stage<10, 13> out;
  out.value << dx.d, dy.d, x.tail<8>();
  out.J.setZero();
  out.J(0, kVx) = dx.dv;
  out.J(1, kVy) = dy.dv;
  out.J.block<8, 8>(2, 5).setIdentity();
  return out;
}

// Paper eq. (15), stage II-9: rho = (v_x - xbar^2, 2 (v_xy - xbar ybar), v_y - ybar^2),
// l+- = sqrt(-ln(1 - Gamma)) sqrt(alpha + phi +- sqrt(D)), c' = R (xbar, ybar, 0) + c.
// Corrected: the factor 2 of beta holds for both terms; J is 10x10 and has no k.
Stage<10, 10>
planeAxes(double factor, const Vec<10>& x)
{
  const double xbar = x[kMeanX], ybar = x[kMeanY];
  const Vector3d r = rotationOf<2>(x.segment<2>(5)), shift(xbar, ybar, 0.0);
  const Matrix3d R = expMap(r);
  const Vector3d rho(x[kVx] - xbar * xbar,
                     2.0 * (x[kVxy] - xbar * ybar),
                     x[kVy] - ybar * ybar);
  Mat<3, 5> drho;
  drho << -2.0 * xbar, 0.0, 1.0, 0.0, 0.0, //
      -2.0 * ybar, -2.0 * xbar, 0.0, 0.0, 2.0, //
      0.0, -2.0 * ybar, 0.0, 1.0, 0.0;
  const PrincipalAxes axes(rho[0], rho[1], rho[2]);
  const double scale = std::sqrt(2.0) * factor; // l^2 = factor^2 2 (eigenvalue)
  const Bound major(scale, axes.larger), minor(scale, axes.smaller);
  Stage<10, 10> out;
  out.value << major.d, minor.d, rho, r.head<2>(), R * shift + x.tail<3>();
  out.J.setZero();
  out.J.block<1, 5>(0, 0) = major.dv * axes.dlarger() * drho;
  out.J.block<1, 5>(1, 0) = minor.dv * axes.dsmaller() * drho;
  out.J.block<3, 5>(2, 0) = drho;
  out.J.block<5, 5>(5, 5).setIdentity();
  out.J.block<3, 2>(7, 0) = R.leftCols<2>();
  out.J.block<3, 2>(7, 5) = rotatedVectorJacobian(r, shift).leftCols<2>();
  return out;
}

// Paper eq. (16): d_c = max(l+, l-), which is l+, or the smooth
// sqrt(-ln(1 - Gamma)) sqrt(alpha + phi).
Stage<6, 10>
planeCircle(double factor, bool smooth, const Vec<10>& x)
{
  const Bound d(factor, x[2] + x[4]);
  Stage<6, 10> out;
  out.value << (smooth ? d.d : x[0]), x.tail<5>();
  out.J.setZero();
  if (smooth)
    out.J(0, 2) = out.J(0, 4) = d.dv;
  else
    out.J(0, 0) = 1.0;
  out.J.block<5, 5>(1, 5).setIdentity();
  return out;
}

namespace {

// Paper eq. (17), r = log(R(r_xy) R_z(t)), t = atan2(beta, alpha - phi)/2, with
// dt/d(alpha, beta, phi) = [-beta, alpha - phi, beta] / (2 D).
template <int ND>
Stage<ND + 6, 10>
planeRotation(bool reversed, const Vec<10>& x)
{
  const PrincipalAxes axes(x[2], x[3], x[4]);
  const Vector3d r_xy = rotationOf<2>(x.segment<2>(5));
  const Stage<3, 3> r = turnedRotation(r_xy, axes.angle + (reversed ? kPi : 0.0));
  Stage<ND + 6, 10> out;
  out.value << Vec<ND>::Zero(), r.value, x.tail<3>();
  out.J.setZero();
  out.J.template block<3, 3>(ND, 2) =
      rightJacobianInverse(r.value).col(2) * axes.dangle();
  out.J.template block<3, 2>(ND, 5) = r.J.leftCols<2>();
  out.J.template block<3, 3>(ND + 3, 7).setIdentity();
  return out;
}

} // namespace

Stage<8, 10>
planeEllipse(bool reversed, const Vec<10>& x)
{
  Stage<8, 10> out = planeRotation<2>(reversed, x);
  out.value.head<2>() = x.head<2>();
  out.J.topLeftCorner<2, 2>().setIdentity();
  return out;
}

// The four radii are |l| and gamma = atan2(l-, l+): dgamma/dl = [-l-, l+] / |l|^2.
Stage<11, 10>
planeQuad(bool reversed, const Vec<10>& x)
{
  const Eigen::RowVector2d l(x[0], x[1]);
  const double radius = l.norm();
  Stage<11, 10> out = planeRotation<5>(reversed, x);
  out.value.head<4>().setConstant(radius);
  out.value[4] = std::atan2(l[1], l[0]);
  out.J.topLeftCorner<4, 2>().rowwise() = l / radius;
  out.J.block<1, 2>(4, 0) << -l[1], l[0];
  out.J.block<1, 2>(4, 0) /= radius * radius;
  return out;
}

}} // namespace holdfast::stagewise
