// Stages I-1 to I-3: the unbounded surface.
#include "uncertainty/stagewise_axes.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <cmath>

namespace holdfast { namespace stagewise {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Stage<2, 3>
revoluteRotation(const Matrix3d& R0, const Vector3d& r)
{
  const Matrix3d R = R0 * expMap(r);
  Stage<2, 3> out;
  out.value = regularRxyFromNormal(R.col(2));
  Eigen::Matrix2d J = Eigen::Matrix2d::Identity();
  rxyJacobian(out.value, J);
  const Matrix3d turn = expMap(rotationOf<2>(out.value)).transpose() * R;
  out.J = J * (turn * rightJacobian(r)).topRows<2>();
  return out;
}

Stage<3, 3>
turnedRotation(const Vector3d& r, double angle)
{
  const Matrix3d turn = expMap({0.0, 0.0, angle});
  Stage<3, 3> out;
  out.value = logMap(expMap(r) * turn);
  out.J = rightJacobianInverse(out.value) * turn.transpose() * rightJacobian(r);
  return out;
}

// The solver has the three parameters a plane has; the paper's five are a function of
// them.
Stage<5, 3>
planeFromTheta(const Pose& plane, const Vec<3>& theta)
{
  const Vector3d delta(theta[0], theta[1], 0.0);
  const Stage<2, 3> r_xy = revoluteRotation(plane.R, delta);
  Stage<5, 3> out;
  out.value << r_xy.value, plane.c + theta[2] * plane.R.col(2);
  out.J.setZero();
  out.J.topLeftCorner<2, 2>() = r_xy.J.leftCols<2>();
  out.J.block<3, 1>(2, 2) = plane.R.col(2);
  return out;
}

Stage<2, 6>
principalNormal(const Vector3d& towards, const Vec<6>& entries)
{
  Matrix3d C;
  C << entries[0], entries[1], entries[2], entries[1], entries[3], entries[4],
      entries[2], entries[4], entries[5];
  Vector3d n = Eigen::SelfAdjointEigenSolver<Matrix3d>(C).eigenvectors().col(0);
  if (n.dot(towards) < 0.0)
    n = -n;
  Stage<2, 6> out;
  out.value = regularRxyFromNormal(n);
  Eigen::Matrix2d J = Eigen::Matrix2d::Zero();
  rxyJacobian(out.value, J);
  // The rotation that moves n is about n x dn.
  const Matrix3d turn = expMap(rotationOf<2>(out.value)).transpose() * skew(n);
  out.J = J * turn.topRows<2>() * normalJacobian(C, n);
  return out;
}

// Sigma_z = (dR/dr z) Sigma_r (dR/dr z)^T of eqs. (3) and (5).
Stage<3, 2>
normalVector(const Vec<2>& r_xy)
{
  const Vector3d r = rotationOf<2>(r_xy);
  return {expMap(r).col(2), rotatedVectorJacobian(r, Vector3d::UnitZ()).leftCols<2>()};
}

// Paper eq. (3), c' = qbar - z^T (qbar - c) z. Corrected: z is a function of r_xy, so
// listing both as inputs counts the tilt twice; the inputs are (qbar, r_xy, c) with c
// before the projection, and the zero blocks of Sigma are 3x5 and 5x3.
Stage<5, 8>
projectedCentre(const Vec<8>& x)
{
  const auto [z, dz] = normalVector(x.segment<2>(3));
  const Vector3d offset = x.head<3>() - x.tail<3>();
  const double height = z.dot(offset);
  Stage<5, 8> out;
  out.value << x.segment<2>(3), x.head<3>() - height * z;
  out.J.setZero();
  out.J.block<2, 2>(0, 3).setIdentity();
  out.J.block<3, 3>(2, 0) = Matrix3d::Identity() - z * z.transpose();
  out.J.block<3, 2>(2, 3) = -z * (offset.transpose() * dz) - height * dz;
  out.J.block<3, 3>(2, 5) = z * z.transpose();
  return out;
}

// Stage I-2 (i), c on a line. Corrected: the Jacobian is blkdiag(I_5, n), not
// I_{6x8}, on the paper's (kappa_x, kappa_y, r); here K takes the place of kappa and
// r_z, which is undetermined where the curvatures are equal. The line itself, through
// the centroid along the plane's normal, counts as known, as in the paper.
Stage<9, 6>
paraboloidFromTheta(const Vector3d& line, const Vec<6>& theta)
{
  const Vector3d r(theta[3], theta[4], 0.0);
  Stage<9, 6> out;
  out.value << theta.head<3>(), r, theta[5] * line;
  out.J.setZero();
  out.J.topLeftCorner<5, 5>().setIdentity();
  out.J.block<3, 1>(6, 5) = line;
  return out;
}

Stage<4, 4>
sphereFromTheta(const Vec<4>& theta)
{
  const double k = theta[0];
  Stage<4, 4> out;
  out.value << k, theta.tail<3>() + Vector3d::UnitZ() / k;
  out.J.setIdentity();
  out.J(3, 0) = -1.0 / (k * k);
  return out;
}

// Paper eq. (4). Corrected: the input is blkdiag(Sigma_r', Sigma_kc) of two fits, and
// the apex moves with the normal that is put in: c = C - z/k, so
// dc = dC + z dk/k^2 - dz/k.
Stage<6, 6>
sphereApex(const Vec<6>& x)
{
  const auto [z, dz] = normalVector(x.head<2>());
  const double k = x[2];
  Stage<6, 6> out;
  out.value << k, x.head<2>(), x.tail<3>() - z / k;
  out.J.setZero();
  out.J(0, 2) = 1.0;
  out.J.block<2, 2>(1, 0).setIdentity();
  out.J.block<3, 2>(3, 0) = dz / -k;
  out.J.block<3, 1>(3, 2) = z / (k * k);
  out.J.block<3, 3>(3, 3).setIdentity();
  return out;
}

Stage<7, 5>
cylinderFromTheta(double sense, const Vec<5>& theta)
{
  const double k = theta[0];
  const Vector3d r(0.0, theta[1], theta[2]), c(0.0, theta[3], theta[4]);
  const Matrix3d R = expMap(r);
  Stage<7, 5> out;
  out.value << sense * R.col(0), k, c + R.col(2) / k;
  out.J.setZero();
  out.J.block<3, 2>(0, 1) =
      sense * rotatedVectorJacobian(r, Vector3d::UnitX()).rightCols<2>();
  out.J(3, 0) = 1.0;
  out.J.block<3, 1>(4, 0) = R.col(2) / (-k * k);
  out.J.block<3, 2>(4, 1) =
      rotatedVectorJacobian(r, Vector3d::UnitZ()).rightCols<2>() / k;
  out.J(5, 3) = out.J(6, 4) = 1.0;
  return out;
}

// Paper eq. (5), r' = log([x, y, z']). Corrected: [x y z] is a rotation only with z
// normal to x, so z' = normalise(z - x x^T z); (x, k, C) come from one fit and keep
// their cross terms; and the apex moves with z' as in eq. (4).
Stage<7, 10>
cylinderApex(const Vec<10>& in)
{
  const Vector3d z = in.head<3>(), x = in.segment<3>(3).normalized();
  const double k = in[6], along = x.dot(z), length = in.segment<3>(3).norm();
  const Vector3d across = z - along * x;
  Matrix3d R;
  R.col(0) = x;
  R.col(2) = across.normalized();
  R.col(1) = R.col(2).cross(x);
  // Rotation of the frame, in its own axes: dx = (0, delta_z, -delta_y) and
  // y . dz' = -delta_x.
  Mat<3, 6> delta;
  delta.row(0) << -R.col(1).transpose(), along / length * R.col(1).transpose();
  delta.row(0) /= across.norm();
  delta.row(1) << 0.0, 0.0, 0.0, -R.col(2).transpose() / length;
  delta.row(2) << 0.0, 0.0, 0.0, R.col(1).transpose() / length;
  Stage<7, 10> out;
  const Vector3d r = logMap(R);
  out.value << k, r, in.tail<3>() - R.col(2) / k;
  out.J.setZero();
  out.J(0, 6) = 1.0;
  out.J.block<3, 6>(1, 0) = rightJacobianInverse(r) * delta;
  out.J.block<3, 6>(4, 0) = R * skew(Vector3d::UnitZ()) * delta / k;
  out.J.block<3, 1>(4, 6) = R.col(2) / (k * k);
  out.J.block<3, 3>(4, 7).setIdentity();
  return out;
}

// Paper eq. (6). Corrected: the row of c is [0 0 I_3], not zero.
Stage<5, 9>
planeFromParaboloid(const Vec<9>& x)
{
  const Stage<2, 3> r_xy = revoluteRotation(Matrix3d::Identity(), x.segment<3>(3));
  Stage<5, 9> out;
  out.value << r_xy.value, x.tail<3>();
  out.J.setZero();
  out.J.block<2, 3>(0, 3) = r_xy.J;
  out.J.block<3, 3>(2, 6).setIdentity();
  return out;
}

// The eigen-decomposition that the paper's parameters (kappa, r) already contain.
Stage<8, 9>
principalCurvatures(const Vec<9>& x)
{
  const PrincipalAxes axes(x[0], 2.0 * x[1], x[2]);
  const Stage<3, 3> r = turnedRotation(x.segment<3>(3), axes.angle);
  Stage<8, 9> out;
  out.value << axes.larger, axes.smaller, r.value, x.tail<3>();
  out.J.setZero();
  const Eigen::RowVector3d by_K(1.0, 2.0, 1.0); // beta = 2 kxy
  out.J.block<1, 3>(0, 0) = axes.dlarger().cwiseProduct(by_K);
  out.J.block<1, 3>(1, 0) = axes.dsmaller().cwiseProduct(by_K);
  out.J.block<3, 3>(2, 0) =
      rightJacobianInverse(r.value).col(2) * axes.dangle().cwiseProduct(by_K);
  out.J.block<3, 3>(2, 3) = r.J;
  out.J.block<3, 3>(5, 6).setIdentity();
  return out;
}

// Paper eq. (7).
Stage<7, 8>
cylindricCurvature(const Vec<8>& x)
{
  Stage<7, 8> out;
  out.value = x.tail<7>();
  out.J << Vec<7>::Zero(), Mat<7, 7>::Identity();
  return out;
}

// Paper eq. (8), r' = log(R(r) [y -x z]). Corrected: it is kappa_x of the unswapped
// covariance that becomes kappa_y, J(1, 1:2) = [1 0]; the Jacobian takes r before it is
// overwritten; elliptic and hyperbolic paraboloids need the swap too.
Stage<8, 8>
swappedAxes(const Vec<8>& x)
{
  const Stage<3, 3> r = turnedRotation(x.segment<3>(2), 0.5 * kPi);
  Stage<8, 8> out;
  out.value << x[1], x[0], r.value, x.tail<3>();
  out.J.setIdentity();
  out.J.topLeftCorner<2, 2>() << 0.0, 1.0, 1.0, 0.0;
  out.J.block<3, 3>(2, 2) = r.J;
  return out;
}

Stage<8, 8>
reversedAxes(const Vec<8>& x)
{
  const Stage<3, 3> r = turnedRotation(x.segment<3>(2), kPi);
  Stage<8, 8> out;
  out.value << x.head<2>(), r.value, x.tail<3>();
  out.J.setIdentity();
  out.J.block<3, 3>(2, 2) = r.J;
  return out;
}

// Paper eq. (9), kappa = (kappa_x + kappa_y)/2. Corrected: by way of K, whose trace
// that is, and not of r_z, whose variance diverges as kappa_x -> kappa_y.
Stage<6, 9>
circularFromParaboloid(const Vec<9>& x)
{
  const Stage<2, 3> r_xy = revoluteRotation(Matrix3d::Identity(), x.segment<3>(3));
  Stage<6, 9> out;
  out.value << 0.5 * (x[0] + x[2]), r_xy.value, x.tail<3>();
  out.J.setZero();
  out.J(0, 0) = out.J(0, 2) = 0.5;
  out.J.block<2, 3>(1, 3) = r_xy.J;
  out.J.block<3, 3>(3, 6).setIdentity();
  return out;
}

}} // namespace holdfast::stagewise
