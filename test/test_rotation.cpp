#include "support/finite_difference.h"
#include "support/random.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/LU>

#include <cmath>
#include <cstdint>
#include <vector>

namespace holdfast { namespace {

using test::numericalJacobian;
using test::Random;
using test::scaledError;

// Everything below is right to rounding; a dozen operations on numbers up to pi lose a
// few units of 2.2e-16.
constexpr double kRounding = 2e-15;

// Around every threshold of the formulas: zero, the series, pi.
const std::vector<double> kAngles{0.0,
                                  1e-300,
                                  1e-12,
                                  1e-8,
                                  1e-4,
                                  0.01,
                                  0.0999999,
                                  0.1,
                                  0.1000001,
                                  1.0,
                                  kPi / 2,
                                  2.0,
                                  3.0,
                                  kPi - 1e-4,
                                  kPi - 1e-8,
                                  kPi - 1e-12,
                                  kPi};

using Matrix3ld = Eigen::Matrix<long double, 3, 3>;

// Sum of (sign X)^n / (n + offset)! in extended precision: the exponential for offset 0
// and sign 1, the right Jacobian for offset 1 and sign -1. Terms reach pi^3/3! = 5 and
// the fiftieth is below 1e-38, so the sum is good to 1e-18.
Eigen::Matrix3d
seriesInX(const Eigen::Vector3d& r, int offset, long double sign)
{
  const Matrix3ld X = sign * skew(r).cast<long double>();
  Matrix3ld term = Matrix3ld::Identity();
  Matrix3ld sum = term;
  for (int n = 1; n < 50; ++n) {
    term = term * X / static_cast<long double>(n + offset);
    sum += term;
  }
  return sum.cast<double>();
}

TEST(Rotation, SkewIsTheCrossProduct)
{
  Random random;
  const Eigen::Vector3d a = random.normalVector();
  const Eigen::Vector3d b = random.normalVector();
  EXPECT_LT((skew(a) * b - a.cross(b)).norm(), kRounding);
}

TEST(Rotation, ExpIsTheMatrixExponential)
{
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    Random random(i);
    const Eigen::Vector3d r = kAngles[i] * random.unitVector();
    EXPECT_LT(scaledError(expMap(r), seriesInX(r, 0, 1.0L)), kRounding);
  }
}

TEST(Rotation, ExpIsARotationForAnyLength)
{
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(i);
    const Eigen::Matrix3d R = expMap(random.uniform(0.0, 20.0) * random.unitVector());
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 4 * kRounding);
    EXPECT_NEAR(R.determinant(), 1.0, 4 * kRounding);
  }
}

TEST(Rotation, LogInvertsExp)
{
  for (std::size_t i = 0; i + 1 < kAngles.size(); ++i) {
    for (std::uint64_t k = 0; k < 20; ++k) {
      Random random(100 * i + k);
      const Eigen::Vector3d r = kAngles[i] * random.unitVector();
      // Relative to the angle: tiny rotations keep all their digits.
      EXPECT_LE((logMap(expMap(r)) - r).norm(), 2 * kRounding * kAngles[i])
          << "angle " << kAngles[i];
    }
  }
}

TEST(Rotation, LogAtPiHasOneSign)
{
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(i);
    // Conjugation leaves the rounding of a few products in R.
    const Eigen::Matrix3d A = random.rotation();
    const Eigen::Matrix3d half_turn = Eigen::Vector3d(-1, -1, 1).asDiagonal();
    const Eigen::Matrix3d R = A * half_turn * A.transpose();
    const Eigen::Vector3d r = logMap(R);
    EXPECT_NEAR(r.norm(), kPi, kRounding);
    EXPECT_GT(r.x(), 0.0);
    EXPECT_LT((expMap(r) - R).norm(), 5 * kRounding);
    EXPECT_LT((logMap(R.transpose()) - r).norm(), 1e-14);
  }
}

TEST(Rotation, LogAtPiAboutCoordinateAxesIsPositive)
{
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d r = kPi * Eigen::Vector3d::Unit(axis);
    EXPECT_LT((logMap(expMap(r)) - r).norm(), kRounding);
    EXPECT_LT((logMap(expMap(-r)) - r).norm(), kRounding);
  }
  const Eigen::Vector3d r = kPi * Eigen::Vector3d(0, 1, -1).normalized();
  EXPECT_LT((logMap(expMap(-r)) - r).norm(), kRounding);
}

TEST(Rotation, RightJacobianIsItsSeries)
{
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    Random random(i);
    const Eigen::Vector3d r = kAngles[i] * random.unitVector();
    EXPECT_LT(scaledError(rightJacobian(r), seriesInX(r, 1, -1.0L)), kRounding);
  }
}

TEST(Rotation, RightJacobianIsTheDerivativeOfExp)
{
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    Random random(i);
    const Eigen::Vector3d r = kAngles[i] * random.unitVector();
    const Eigen::Matrix3d R = expMap(r);
    const auto delta = [&](const Eigen::VectorXd& moved) -> Eigen::VectorXd {
      return logMap(R.transpose() * expMap(moved));
    };
    // Error of the differences: see numericalJacobian().
    EXPECT_LT(scaledError(rightJacobian(r), numericalJacobian(delta, r)), 1e-11);
  }
}

TEST(Rotation, RightJacobianInverseInvertsIt)
{
  std::vector<double> angles = kAngles;
  angles.insert(angles.end(), {4.0, 5.0, 6.0});
  for (std::size_t i = 0; i < angles.size(); ++i) {
    Random random(i);
    const Eigen::Vector3d r = angles[i] * random.unitVector();
    const Eigen::Matrix3d inverse = rightJacobianInverse(r);
    // Both diverge towards 2 pi, which scales the rounding.
    EXPECT_LT((rightJacobian(r) * inverse - Eigen::Matrix3d::Identity()).norm(),
              4 * kRounding * inverse.norm());
  }
}

TEST(Rotation, RotatedVectorJacobianIsTheDerivative)
{
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    Random random(i);
    const Eigen::Vector3d r = kAngles[i] * random.unitVector();
    const Eigen::Vector3d v = random.normalVector();
    const auto rotated = [&](const Eigen::VectorXd& moved) -> Eigen::VectorXd {
      return expMap(moved) * v;
    };
    EXPECT_LT(scaledError(rotatedVectorJacobian(r, v), numericalJacobian(rotated, r)),
              1e-11);
  }
}

TEST(Rotation, RxyTakesZToTheNormal)
{
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    Random random(i);
    const double azimuth = random.uniform(-kPi, kPi);
    const Eigen::Vector2d r_xy =
        kAngles[i] * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
    const Eigen::Vector3d normal = expMap({r_xy.x(), r_xy.y(), 0.0}).col(2);
    const Eigen::Vector2d found = rxyFromNormal(normal);
    EXPECT_LT((expMap({found.x(), found.y(), 0.0}).col(2) - normal).norm(), kRounding);
    // Near -z the axis is known to rounding over the distance from it.
    if (kAngles[i] < kPi - 1e-13) {
      EXPECT_LE((found - r_xy).norm(),
                kRounding * kAngles[i] * (1.0 + 1.0 / (kPi - kAngles[i])));
    }
  }
}

TEST(Rotation, RxyOfOppositeNormalIsAboutX)
{
  const double tiny = 1e-16;
  for (const Eigen::Vector3d& normal : {Eigen::Vector3d(0, 0, -1),
                                        Eigen::Vector3d(-tiny, 0, -1),
                                        Eigen::Vector3d(0, tiny, -1)})
    EXPECT_EQ(rxyFromNormal(normal), Eigen::Vector2d(kPi, 0.0));
}

TEST(Rotation, RegularRxyKeepsOffTheSingularity)
{
  for (std::size_t i = 0; i < kAngles.size(); ++i) {
    Random random(i);
    const double azimuth = random.uniform(-kPi, kPi);
    const Eigen::Vector2d r_xy =
        kAngles[i] * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
    const Eigen::Vector3d normal = expMap({r_xy.x(), r_xy.y(), 0.0}).col(2);
    const Eigen::Vector2d found = regularRxyFromNormal(normal);
    EXPECT_LE(found.norm(), kPi - 0.999 * kRxyMargin);
    Eigen::Matrix2d J;
    EXPECT_TRUE(rxyJacobian(found, J));
    EXPECT_LT((expMap({found.x(), found.y(), 0.0}).col(2) - normal).norm(),
              2.001 * kRxyMargin);
    if (kAngles[i] < kPi - kRxyMargin) {
      EXPECT_EQ(found, rxyFromNormal(normal));
    }
  }
}

TEST(Rotation, RxyJacobianIsTheDerivative)
{
  for (const double angle : {0.0, 1e-8, 1e-4, 0.05, 0.1, 1.0, 2.0, 3.0}) {
    Random random(static_cast<std::uint64_t>(1e8 * angle));
    const double azimuth = random.uniform(-kPi, kPi);
    const Eigen::Vector2d r_xy =
        angle * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
    const Eigen::Matrix3d R = expMap({r_xy.x(), r_xy.y(), 0.0});
    const auto turned = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
      return rxyFromNormal((R * expMap({delta(0), delta(1), 0.0})).col(2));
    };
    Eigen::Matrix2d J;
    ASSERT_TRUE(rxyJacobian(r_xy, J));
    // A small step, as higher derivatives grow like powers of 1 / (pi - angle): at 3
    // rad the fifth is 1e6, times h^4 = 1e-16; rounding adds eps pi / h = 1e-11.
    const Eigen::MatrixXd expected =
        numericalJacobian(turned, Eigen::Vector2d::Zero(), 1e-4);
    EXPECT_LT(scaledError(J, expected), 1e-9) << "angle " << angle;
  }
}

TEST(Rotation, RxyJacobianInvertsTheBlockOfTheRightJacobian)
{
  for (const double angle : {0.0, 1e-8, 0.1, 1.0, kPi - 1e-4, kPi - 1e-7}) {
    Random random(static_cast<std::uint64_t>(1e8 * angle));
    const double azimuth = random.uniform(-kPi, kPi);
    const Eigen::Vector2d r_xy =
        angle * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
    Eigen::Matrix2d J;
    ASSERT_TRUE(rxyJacobian(r_xy, J));
    const Eigen::Matrix3d Jr = rightJacobian({r_xy.x(), r_xy.y(), 0.0});
    EXPECT_LT((J * Jr.topLeftCorner<2, 2>() - Eigen::Matrix2d::Identity()).norm(),
              kRounding * J.norm());
  }
}

TEST(Rotation, RxyJacobianRefusesTheSingularity)
{
  Eigen::Matrix2d J = Eigen::Matrix2d::Constant(7.0);
  EXPECT_FALSE(rxyJacobian({kPi, 0.0}, J));
  EXPECT_FALSE(rxyJacobian({0.0, -(kPi - 1e-10)}, J));
  EXPECT_EQ(J, Eigen::Matrix2d::Constant(7.0));
}

TEST(Rotation, FrameFromZIsRightHandedAroundZ)
{
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(i);
    const Eigen::Vector3d z =
        i < 3 ? Eigen::Vector3d::Unit(static_cast<int>(i)) : random.unitVector();
    const Eigen::Matrix3d R = frameFromZ(z);
    EXPECT_EQ(R.col(2), z);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), kRounding);
    EXPECT_NEAR(R.determinant(), 1.0, kRounding);
  }
}

}} // namespace holdfast
