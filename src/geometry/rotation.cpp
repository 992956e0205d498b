#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <cmath>

namespace holdfast {
namespace {

// sin(t) of a rotation by pi is known to a few units in the last place after the
// handful of products a pose goes through; below this the angle is pi.
constexpr double kSineOfPi = 1e-14;

// Below this angle the coefficients that cancel for small t come from four terms of
// their series: the fifth is under 3e-16 there, while the closed forms lose at most
// eps / t^2 = 2e-14 above it, which their factor X^2 ~ t^2 brings back to rounding.
constexpr double kSeriesAngle = 0.1;

// By its series where that is as good, since a fit asks for small angles alone.
double
sinc(double t)
{
  const double t2 = t * t;
  if (t < kSeriesAngle)
    return 1.0 + t2 * (-1.0 / 6 + t2 * (1.0 / 120 + t2 * (-1.0 / 5040 + t2 / 362880)));
  return std::sin(t) / t;
}

// (1 - cos t) / t^2 without cancellation.
double
versineOverSquare(double t)
{
  const double s = sinc(0.5 * t);
  return 0.5 * s * s;
}

// (t - sin t) / t^3.
double
cubicRemainder(double t)
{
  const double t2 = t * t;
  if (t < kSeriesAngle)
    return 1.0 / 6 + t2 * (-1.0 / 120 + t2 * (1.0 / 5040 - t2 / 362880));
  return (t - std::sin(t)) / (t2 * t);
}

// 1/t^2 - 1/(2 t tan(t/2)).
double
inverseCoefficient(double t)
{
  const double t2 = t * t;
  if (t < kSeriesAngle)
    return 1.0 / 12 + t2 * (1.0 / 720 + t2 * (1.0 / 30240 + t2 / 1209600));
  const double half = 0.5 * t;
  return (1.0 - half * std::cos(half) / std::sin(half)) / t2;
}

// True when the first component of u that is not zero within rounding is negative.
bool
startsNegative(const Eigen::Vector3d& u)
{
  for (const double component : u)
    if (std::abs(component) > kSineOfPi)
      return component < 0.0;
  return false;
}

// Rotation axis from the symmetric part cos(t) I + (1 - cos(t)) u u^T, which determines
// it well where sin(t) is small; `sine_axis` = sin(t) u tells u from -u.
Eigen::Vector3d
axisOfLargeAngle(const Eigen::Matrix3d& R,
                 const Eigen::Vector3d& sine_axis,
                 double cosine)
{
  Eigen::Matrix3d outer = 0.5 * (R + R.transpose());
  outer.diagonal().array() -= cosine;
  Eigen::Index largest = 0;
  outer.diagonal().maxCoeff(&largest);
  const Eigen::Vector3d u = outer.col(largest).normalized();
  const bool flip =
      sine_axis.norm() > kSineOfPi ? u.dot(sine_axis) < 0.0 : startsNegative(u);
  return flip ? Eigen::Vector3d(-u) : u;
}

} // namespace

Eigen::Matrix3d
skew(const Eigen::Vector3d& a)
{
  Eigen::Matrix3d X;
  // clang-format off
  X <<   0.0, -a.z(),  a.y(),
       a.z(),    0.0, -a.x(),
      -a.y(),  a.x(),    0.0;
  // clang-format on
  return X;
}

Eigen::Matrix3d
expMap(const Eigen::Vector3d& r)
{
  const double t = r.norm();
  const Eigen::Matrix3d X = skew(r);
  return Eigen::Matrix3d::Identity() + sinc(t) * X + versineOverSquare(t) * X * X;
}

Eigen::Vector3d
logMap(const Eigen::Matrix3d& R)
{
  const Eigen::Vector3d sine_axis =
      0.5 * Eigen::Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  const double sine = sine_axis.norm();
  const double cosine = 0.5 * (R.trace() - 1.0);
  const double t = std::atan2(sine, cosine);
  if (cosine < 0.0)
    return t * axisOfLargeAngle(R, sine_axis, cosine);
  return sine > 0.0 ? Eigen::Vector3d(t / sine * sine_axis) : sine_axis;
}

Eigen::Matrix3d
rightJacobian(const Eigen::Vector3d& r)
{
  const double t = r.norm();
  const Eigen::Matrix3d X = skew(r);
  return Eigen::Matrix3d::Identity() - versineOverSquare(t) * X +
         cubicRemainder(t) * X * X;
}

Eigen::Matrix3d
rightJacobianInverse(const Eigen::Vector3d& r)
{
  const Eigen::Matrix3d X = skew(r);
  return Eigen::Matrix3d::Identity() + 0.5 * X + inverseCoefficient(r.norm()) * X * X;
}

Eigen::Matrix3d
rotatedVectorJacobian(const Eigen::Vector3d& r, const Eigen::Vector3d& v)
{
  return -expMap(r) * skew(v) * rightJacobian(r);
}

Eigen::Vector2d
rxyFromNormal(const Eigen::Vector3d& normal)
{
  const double sine = std::hypot(normal.x(), normal.y());
  if (normal.z() < 0.0 && sine <= kSineOfPi)
    return {kPi, 0.0};
  if (sine == 0.0)
    return {0.0, 0.0};
  // The axis is z x normal, the shortest way from z to the normal.
  const double scale = std::atan2(sine, normal.z()) / sine;
  return {-scale * normal.y(), scale * normal.x()};
}

Eigen::Vector2d
regularRxyFromNormal(const Eigen::Vector3d& normal)
{
  const bool opposite = normal.z() < 0.0;
  if (opposite && std::hypot(normal.x(), normal.y()) <= kRxyMargin)
    return {kPi - kRxyMargin, 0.0};
  return rxyFromNormal(normal);
}

bool
rxyJacobian(const Eigen::Vector2d& r_xy, Eigen::Matrix2d& J)
{
  const double t = r_xy.norm();
  if (std::abs(sinc(t)) < 1e-9)
    return false;
  // With r_z = 0 the block of Jr stretches by 1 along r_xy and by sin(t)/t across it.
  const double across = 1.0 / sinc(t);
  const Eigen::Vector2d u = t > 0.0 ? Eigen::Vector2d(r_xy / t) : r_xy;
  J = across * Eigen::Matrix2d::Identity() + (1.0 - across) * u * u.transpose();
  return true;
}

Eigen::Matrix3d
frameFromZ(const Eigen::Vector3d& z)
{
  Eigen::Index least = 0;
  z.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d axis = Eigen::Vector3d::Unit(least);
  Eigen::Matrix3d R;
  R.col(0) = (axis - z.dot(axis) * z).normalized();
  R.col(1) = z.cross(R.col(0));
  R.col(2) = z;
  return R;
}

} // namespace holdfast
