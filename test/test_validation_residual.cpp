// Distances of points to the unbounded surface of a patch.
#include "support/random_patch.h"

#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/validation/residual.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast { namespace {

using test::Random;
using test::randomPatch;
using test::randomPose;

constexpr std::uint64_t kCases = 30;

// Coordinates of a few metres through a pose and back.
constexpr double kRounding = 1e-13;

double
largestCurvature(const Patch& patch)
{
  return patch.principalCurvatures().lpNorm<Eigen::Infinity>();
}

// A point at a signed distance along the normal of a random foot point, world frame.
// Up to the radius of curvature, no other point of the surface is nearer.
Eigen::Vector3d
displacedPoint(Random& random, const Patch& patch, double distance)
{
  const Eigen::Vector2d xy =
      random.uniform(0.0, 1.0) * boundaryPoint(patch, random.uniform(0.0, 3.999));
  const Eigen::Vector3d foot =
      patch.pose().toWorld({xy.x(), xy.y(), height(patch, xy.x(), xy.y()).value()});
  return foot + distance * normalAt(patch, xy.x(), xy.y()).value();
}

class SurfaceDistance : public testing::TestWithParam<PatchType> {};

TEST_P(SurfaceDistance, IsTheDisplacementAlongTheNormal)
{
  for (std::uint64_t i = 0; i < 10 * kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const double radius = 1.0 / std::max(largestCurvature(patch), 1.0);
    const double distance = random.uniform(-0.95, 0.95) * radius;
    const Eigen::Vector3d point = displacedPoint(random, patch, distance);
    EXPECT_NEAR(distanceToSurface(patch, point), distance, kRounding);
  }
}

TEST_P(SurfaceDistance, IsThatToTheNearestPointWhichLiesOnTheSurface)
{
  for (std::uint64_t i = 0; i < 10 * kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d point = patch.c + random.uniformVector(-0.5, 0.5);
    const Eigen::Vector3d foot = nearestSurfacePoint(patch, point);
    // f changes by twice the step on the way to a point near the vertex, by ten times
    // that on the steepest slopes.
    EXPECT_NEAR(implicitValue(patch, foot), 0.0, 10 * kRounding);
    EXPECT_NEAR((point - foot).norm(),
                std::abs(distanceToSurface(patch, point)),
                kRounding);
  }
}

TEST_P(SurfaceDistance, MovesWithThePatch)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d point = patch.c + random.uniformVector(-0.3, 0.3);
    const Pose T = randomPose(random);
    const Patch moved = transformed(patch, T);
    EXPECT_NEAR(distanceToSurface(moved, T.toWorld(point)),
                distanceToSurface(patch, point),
                kRounding);
    EXPECT_NEAR(approximateDistanceToSurface(moved, T.toWorld(point)),
                approximateDistanceToSurface(patch, point),
                kRounding);
  }
}

// Whoever walks a step comes nearer to a set by that step at most. A foot point that is
// not the nearest of all breaks this where the nearest changes: on the axes of the
// local frame, beyond the centres of curvature.
TEST_P(SurfaceDistance, ChangesByNoMoreThanTheStep)
{
  for (std::uint64_t i = 0; i < 20 * kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    Eigen::Vector3d local = random.uniformVector(-1.0, 1.0);
    local[random.integer(0, 1)] = 0.0;
    local[random.integer(0, 1)] *= random.integer(0, 1);
    const double step = std::pow(10.0, random.uniform(-16.0, -1.0));
    const Eigen::Vector3d a = patch.pose().toWorld(local);
    const Eigen::Vector3d b = a + step * random.unitVector();
    const double change =
        std::abs(distanceToSurface(patch, a)) - std::abs(distanceToSurface(patch, b));
    EXPECT_LE(std::abs(change), step + kRounding);
  }
}

TEST_P(SurfaceDistance, ApproximationIsWithinItsBound)
{
  for (std::uint64_t i = 0; i < 100 * kCases; ++i) {
    Random random(i);
    Patch patch = randomPatch(random, GetParam());
    if (isParaboloid(patch.type.surface))
      patch.d *= random.uniform(0.1, 10.0); // slopes up to 9
    const double kt = std::pow(10.0, random.uniform(-3.0, std::log10(0.5)));
    const double t = kt / std::max(largestCurvature(patch), 1.0);
    const Eigen::Vector3d point = displacedPoint(random, patch, random.sign() * t);
    const double approximate = std::abs(approximateDistanceToSurface(patch, point));
    const double bound =
        isParaboloid(patch.type.surface) ? kt * kt / 8.0 / std::pow(1.0 - kt, 2) : 0.0;
    const double rounding = 1e-12; // of heights up to 10 m on the steepest slopes
    EXPECT_GE(approximate, t - rounding);
    EXPECT_LE(approximate, t * (1.0 + bound) + rounding);
  }
}

TEST_P(SurfaceDistance, ResidualIsTheRootMeanSquare)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const double radius = 1.0 / std::max(largestCurvature(patch), 1.0);
    std::vector<Eigen::Vector3d> points;
    double sum = 0.0, largest = 0.0;
    for (int k = 0; k < 100; ++k) {
      // Most of the size of noise, some far beyond what the approximation is good for.
      const double scale = random.integer(0, 9) == 0 ? 0.9 : 0.05;
      const double distance = random.uniform(-scale, scale) * radius;
      points.push_back(displacedPoint(random, patch, distance));
      sum += distance * distance;
      largest = std::max(largest, std::abs(distance));
    }
    const SurfaceResidual residual = measureResidual(patch, points);
    const double rms = std::sqrt(sum / 100.0);
    EXPECT_EQ(residual.points, 100);
    EXPECT_NEAR(residual.rms_m, rms, 1e-3 * rms);
    EXPECT_NEAR(residual.largest_m, largest, 1e-3 * largest);
  }
}

// Points are unexplained beyond four of their sigmas along the normal, whatever their
// noise is across it.
TEST_P(SurfaceDistance, WhatNoiseExplainsIsToldFromTheRest)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const double radius = 1.0 / std::max(largestCurvature(patch), 1.0);
    const Eigen::Vector3d n = patch.normal();
    PointBatch batch;
    batch.clear(patch.c);
    std::vector<Eigen::Vector3d> points;
    double unexplained = 0.0;
    for (int k = 0; k < 100; ++k) {
      const double distance = random.uniform(0.001, 0.05) * radius;
      const double sigma = random.uniform(0.001, 0.05) * radius;
      points.push_back(displacedPoint(random, patch, random.sign() * distance));
      const double across = random.uniform(0.0, 0.1) * radius;
      batch.add(points.back(),
                sigma * sigma * n * n.transpose() +
                    across * across *
                        (Eigen::Matrix3d::Identity() - n * n.transpose()));
      if (distance > kNoiseSigmas * sigma)
        unexplained = std::max(unexplained, distance);
    }
    EXPECT_NEAR(measureResidual(patch, batch).unexplained_m,
                unexplained,
                1e-3 * unexplained);
    const SurfaceResidual without = measureResidual(patch, points);
    EXPECT_EQ(without.unexplained_m, without.largest_m);
  }
}

TEST_P(SurfaceDistance, BatchAndListAgreeAndSkipWhatIsNotFinite)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<Eigen::Vector3d> points{{nan, 0.0, 0.0}, {0.0, infinity, 0.0}};
  EXPECT_EQ(measureResidual(patch, points).points, 0);
  EXPECT_EQ(measureResidual(patch, points).rms_m, 0.0);
  EXPECT_EQ(measureResidual(patch, std::vector<Eigen::Vector3d>()).points, 0);
  EXPECT_EQ(measureResidual(patch, PointBatch()).points, 0);
  for (int k = 0; k < 50; ++k)
    points.push_back(displacedPoint(random, patch, random.uniform(-0.01, 0.01)));
  PointBatch batch;
  batch.clear(points.back());
  for (const Eigen::Vector3d& point : points)
    batch.add(point, Eigen::Matrix3d::Identity());
  const SurfaceResidual of_list = measureResidual(patch, points);
  const SurfaceResidual of_batch = measureResidual(patch, batch);
  EXPECT_EQ(of_list.points, 50);
  EXPECT_EQ(of_batch.points, 50);
  EXPECT_NEAR(of_batch.rms_m, of_list.rms_m, kRounding);
  EXPECT_NEAR(of_batch.largest_m, of_list.largest_m, kRounding);
}

TEST_P(SurfaceDistance, FarFromTheWorldsOriginTheBatchKeepsItsPrecision)
{
  Random random;
  Patch patch = randomPatch(random, GetParam());
  patch.c = Eigen::Vector3d(4e6, -3e6, 1e6).array().round();
  Patch near = patch;
  near.c.setZero();
  PointBatch batch;
  batch.clear(patch.c);
  batch.resize(50);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d point = displacedPoint(random, near, 1e-3 * random.sign());
    for (const int axis : {0, 1, 2})
      batch.channel(static_cast<PointBatch::Channel>(axis))[k] = point[axis];
  }
  // A thousandth of a distance at most, and far less at kappa t < 0.006.
  EXPECT_NEAR(measureResidual(patch, batch).rms_m, 1e-3, 1e-8);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         SurfaceDistance,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

class ParaboloidFoot : public testing::TestWithParam<SurfaceType> {};

// The smallest distance from q to points of z = (kx x^2 + ky y^2)/2, by search over a
// grid and refinement around each of its local minima.
class BruteForce {
public:
  BruteForce(const Patch& patch, const Eigen::Vector3d& q) : patch_(patch), q_(q) {}

  double distance() const
  {
    double least = std::numeric_limits<double>::infinity();
    for (int i = -kLines; i <= kLines; ++i)
      for (int j = -kLines; j <= kLines; ++j)
        if (isLocalMinimum(kStep * i, kStep * j))
          least = std::min(least, refined(kStep * i, kStep * j));
    return std::sqrt(least);
  }

private:
  // The foot is no farther from q than the origin is: within 2 |q| < 1.8 of the origin.
  static constexpr int kLines = 45;
  static constexpr double kStep = 0.04;

  double squared(double x, double y) const
  {
    return (Eigen::Vector3d(x, y, height(patch_, x, y).value()) - q_).squaredNorm();
  }

  bool isLocalMinimum(double x, double y) const
  {
    const double here = squared(x, y);
    for (const double dx : {-kStep, 0.0, kStep})
      for (const double dy : {-kStep, 0.0, kStep})
        if (squared(x + dx, y + dy) < here)
          return false;
    return true;
  }

  // The value at a minimum is flat: a position known to 1e-9 gives it to rounding.
  double refined(double x, double y) const
  {
    double least = squared(x, y);
    for (double reach = kStep; reach > 1e-9; reach *= 0.7) {
      const double x0 = x, y0 = y;
      for (int i = -2; i <= 2; ++i)
        for (int j = -2; j <= 2; ++j) {
          const double value = squared(x0 + 0.5 * i * reach, y0 + 0.5 * j * reach);
          if (value < least) {
            least = value;
            x = x0 + 0.5 * i * reach;
            y = y0 + 0.5 * j * reach;
          }
        }
    }
    return least;
  }

  const Patch& patch_;
  Eigen::Vector3d q_;
};

TEST_P(ParaboloidFoot, IsTheNearestOfAllPoints)
{
  for (std::uint64_t i = 0; i < 2 * kCases; ++i) {
    Random random(i);
    Patch patch = randomPatch(random, {GetParam(), defaultBoundary(GetParam())});
    patch.r.setZero();
    patch.c.setZero();
    Eigen::Vector3d q = random.uniformVector(-0.5, 0.5);
    if (i % 3 == 0)
      q[random.integer(0, 1)] = 0.0;
    if (i % 5 == 0)
      q.head<2>().setZero();
    const double exact = std::abs(distanceToSurface(patch, q));
    EXPECT_NEAR(exact, BruteForce(patch, q).distance(), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Paraboloids,
                         ParaboloidFoot,
                         testing::Values(SurfaceType::EllipticParaboloid,
                                         SurfaceType::HyperbolicParaboloid,
                                         SurfaceType::CylindricParaboloid,
                                         SurfaceType::CircularParaboloid),
                         [](const testing::TestParamInfo<SurfaceType>& surface) {
                           return std::string(surfaceName(surface.param));
                         });

Patch
unitPatch(SurfaceType surface, double kappa)
{
  Patch patch;
  patch.type = {surface, defaultBoundary(surface)};
  patch.d.head(boundaryParameterCount(patch.type.boundary)).setConstant(0.1);
  patch.kappa.x() = kappa;
  return patch;
}

TEST(SurfaceDistances, AboveTheFocusOfABowlTheFeetFormARing)
{
  // z = 2 rho^2: from (0, 0, h) the distance h^2 - 4 h rho^2 + rho^2 + 4 rho^4 is least
  // at rho^2 = (4 h - 1)/8.
  const Patch bowl = unitPatch(SurfaceType::CircularParaboloid, 4.0);
  EXPECT_NEAR(distanceToSurface(bowl, {0, 0, 0.25}), 0.25, kRounding);
  EXPECT_NEAR(distanceToSurface(bowl, {0, 0, 1.0}), std::sqrt(0.4375), kRounding);
  const Patch dome = unitPatch(SurfaceType::CircularParaboloid, -4.0);
  EXPECT_NEAR(distanceToSurface(dome, {0, 0, -1.0}), -std::sqrt(0.4375), kRounding);
}

TEST(SurfaceDistances, RoundSurfacesAreWhole)
{
  const Patch ball = unitPatch(SurfaceType::Sphere, -5.0);
  EXPECT_NEAR(distanceToSurface(ball, {0, 0, -0.2}), -0.2, kRounding) << "centre";
  EXPECT_NEAR(distanceToSurface(ball, {0, 0, -0.5}), 0.1, kRounding) << "far side";
  const Patch pipe = unitPatch(SurfaceType::CircularCylinder, -5.0);
  EXPECT_NEAR(distanceToSurface(pipe, {9, 0, -0.2}), -0.2, kRounding) << "axis";
  EXPECT_NEAR(distanceToSurface(pipe, {9, 0.3, -0.2}), 0.1, kRounding) << "beside";
}

TEST(SurfaceDistances, HoldForSurfacesThatAreAlmostFlat)
{
  for (const SurfaceType surface : {SurfaceType::Sphere,
                                    SurfaceType::CircularCylinder,
                                    SurfaceType::CylindricParaboloid,
                                    SurfaceType::CircularParaboloid})
    for (const double kappa : {1e-300, -1e-12, 1e-6})
      EXPECT_NEAR(distanceToSurface(unitPatch(surface, kappa), {0.1, 0.2, 0.01}),
                  0.01 - 0.5 * kappa * 0.05,
                  std::abs(kappa) * 0.02)
          << surfaceName(surface);
}

}} // namespace holdfast
