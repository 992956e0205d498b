/// \file Exponential coordinates of rotations, with their Jacobians.
///
/// The one perturbation convention of the library: a rotation is perturbed on the
/// right, in its own axes, `R <- R Exp(delta)`. Every Jacobian below is with respect to
/// that delta or to the additive exponential coordinates r (paper: R(r) = exp([r]x)).
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// Cross-product matrix: skew(a) b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// R(r) = exp([r]x) (Rodrigues), exact to rounding for every |r|, including 0.
Eigen::Matrix3d expMap(const Eigen::Vector3d& r);

/// The r with expMap(r) = R and |r| <= pi. At |r| = pi the two solutions r, -r are told
/// apart by making the first non-zero component of r positive.
/// \param R a rotation matrix, orthonormal to rounding.
Eigen::Vector3d logMap(const Eigen::Matrix3d& R);

/// Right Jacobian Jr(r): Exp(r + dr) = Exp(r) Exp(Jr(r) dr) to first order.
Eigen::Matrix3d rightJacobian(const Eigen::Vector3d& r);

/// Inverse of rightJacobian(r), finite for |r| < 2 pi:
/// Jr^-1 = I + X/2 + b X^2 with X = [r]x, b = 1/t^2 - 1/(2 t tan(t/2)), t = |r|.
Eigen::Matrix3d rightJacobianInverse(const Eigen::Vector3d& r);

/// d(R(r) v)/dr = -R(r) [v]x Jr(r), 3x3.
Eigen::Matrix3d rotatedVectorJacobian(const Eigen::Vector3d& r,
                                      const Eigen::Vector3d& v);

/// The rotation about an axis in the xy plane, r = [rx ry 0], that takes the z axis to
/// the unit vector `normal`: the orientation of a patch with revolute symmetry.
/// At normal = -z every axis does; [pi 0] is returned.
Eigen::Vector2d rxyFromNormal(const Eigen::Vector3d& normal);

/// How near to pi regularRxyFromNormal() lets |r_xy| come, radians: a thousandth of the
/// sigma of any normal a depth camera gives, and far enough that the variances, which
/// grow with its inverse square, keep their digits.
inline constexpr double kRxyMargin = 1e-6;

/// rxyFromNormal(), kept off the chart's singularity at -z, where a camera sees what
/// faces it exactly: for normals within kRxyMargin of -z it is [pi - kRxyMargin, 0],
/// whose normal is within twice kRxyMargin of theirs. Along a coordinate axis, so that
/// what the chart cannot tell is one parameter's huge variance and takes no digits from
/// the other's.
Eigen::Vector2d regularRxyFromNormal(const Eigen::Vector3d& normal);

/// Derivative of r_xy with respect to (delta_x, delta_y), a perturbation of
/// R = Exp([r_xy 0]) in its own axes (delta_z follows from r_z = 0 and does not
/// matter). It is the inverse of the upper left 2x2 block of Jr and diverges as |r_xy|
/// -> pi, where the chart r_xy is singular. \return false, and J unchanged, where the
/// block is singular: |sin t / t| < 1e-9.
bool rxyJacobian(const Eigen::Vector2d& r_xy, Eigen::Matrix2d& J);

/// A right-handed orthonormal frame whose z axis is the unit vector z; its x axis is
/// the projection of the coordinate axis least aligned with z.
Eigen::Matrix3d frameFromZ(const Eigen::Vector3d& z);

} // namespace holdfast
