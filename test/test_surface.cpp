#include "support/finite_difference.h"
#include "support/random_patch.h"

#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>

#include <Eigen/Geometry>

#include <cmath>

namespace holdfast { namespace {

using test::numericalJacobian;
using test::Random;
using test::randomPatch;
using test::scaledError;

constexpr std::uint64_t kCases = 30;

// Coordinates of a few metres through a pose and back.
constexpr double kRounding = 1e-13;

class Surface : public testing::TestWithParam<PatchType> {};

// A local (x, y) inside the boundary, at most `reach` of the way to it.
Eigen::Vector2d
pointInside(Random& random, const Patch& patch, double reach = 0.99)
{
  const double scale = random.uniform(0.0, reach);
  return scale * boundaryPoint(patch, random.uniform(0.0, 3.999));
}

// World point of the surface over a local (x, y).
Eigen::Vector3d
lifted(const Patch& patch, const Eigen::Vector2d& xy)
{
  return patch.pose().toWorld({xy.x(), xy.y(), height(patch, xy.x(), xy.y()).value()});
}

TEST_P(Surface, CentreIsOnItWithTheNormalAlongZ)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  EXPECT_NEAR(implicitValue(patch, patch.c), 0.0, kRounding);
  EXPECT_EQ(height(patch, 0.0, 0.0), 0.0);
  EXPECT_LT((normalAt(patch, 0.0, 0.0).value() - patch.normal()).norm(), kRounding);
}

TEST_P(Surface, HeightSatisfiesTheImplicitForm)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d q = lifted(patch, pointInside(random, patch));
    EXPECT_NEAR(implicitValue(patch, q), 0.0, kRounding);
  }
}

TEST_P(Surface, PrincipalCurvaturesAreTheSecondDerivativesOfHeight)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector2d k = patch.principalCurvatures();
    const double h = 1e-3;
    // The sheet's fourth derivative, 3 k^3 < 700, enters with h^2 / 12; rounding with
    // eps z / h^2.
    EXPECT_NEAR(2.0 * height(patch, h, 0.0).value() / (h * h), k.x(), 1e-4);
    EXPECT_NEAR(2.0 * height(patch, 0.0, h).value() / (h * h), k.y(), 1e-4);
  }
}

TEST_P(Surface, PositiveCurvatureBendsTowardsTheNormal)
{
  Random random;
  Patch patch = randomPatch(random, GetParam());
  const Eigen::Vector2d k = patch.principalCurvatures();
  EXPECT_EQ(std::signbit(height(patch, 0.0, 0.05).value()), k.y() < 0.0);
  EXPECT_EQ(height(patch, 0.0, 0.05).value() == 0.0, k.y() == 0.0);
}

TEST_P(Surface, GradientIsTheDerivative)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d q = patch.c + random.uniformVector(-0.2, 0.2);
    const auto value = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
      return Eigen::VectorXd::Constant(1, implicitValue(patch, at));
    };
    // f is quadratic: only rounding of f ~ 1 over the step of 1e-3.
    EXPECT_LT(scaledError(implicitGradient(patch, q).transpose(),
                          numericalJacobian(value, Eigen::VectorXd(q))),
              1e-11);
  }
}

TEST_P(Surface, NormalIsUnitAgainstTheGradientAndAcrossTheSurface)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector2d xy = pointInside(random, patch);
    const Eigen::Vector3d normal = normalAt(patch, xy.x(), xy.y()).value();
    EXPECT_NEAR(normal.norm(), 1.0, kRounding);
    EXPECT_GT(normal.dot(patch.normal()), 0.0);
    const Eigen::Vector3d gradient = implicitGradient(patch, lifted(patch, xy));
    EXPECT_LT((normal + gradient.normalized()).norm(), kRounding);
    const auto point = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
      return lifted(patch, Eigen::Vector2d(at));
    };
    const Eigen::MatrixXd tangents =
        numericalJacobian(point, Eigen::VectorXd(xy), 1e-4);
    // Near the boundary of a sphere the fifth derivative is below 1e7.
    EXPECT_LT((tangents.transpose() * normal).norm(), 1e-8);
  }
}

TEST_P(Surface, RayHitsThePointItIsAimedAt)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector2d xy = pointInside(random, patch);
    const Eigen::Vector3d target = lifted(patch, xy);
    const Eigen::Vector3d normal = normalAt(patch, xy.x(), xy.y()).value();
    // From 1 m along the normal, where no patch of this size hides a part of itself.
    const Eigen::Vector3d origin = target + normal;
    const double length = random.uniform(0.1, 3.0);
    const auto t = intersectRay(patch, origin, -length * normal);
    ASSERT_TRUE(t.has_value());
    const Eigen::Vector3d hit = origin - *t * length * normal;
    EXPECT_NEAR(implicitValue(patch, hit), 0.0, kRounding);
    EXPECT_TRUE(contains(patch, patch.pose().toLocal(hit).head<2>()));
    EXPECT_NEAR(*t * length, 1.0, kRounding);
    EXPECT_FALSE(intersectRay(patch, origin, length * normal)) << "backwards";
  }
}

TEST_P(Surface, RayHitsFromAnyDirectionAreFirstAndOnThePatch)
{
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d target = lifted(patch, pointInside(random, patch));
    const Eigen::Vector3d direction = random.unitVector();
    const Eigen::Vector3d origin = target - direction;
    const auto t = intersectRay(patch, origin, direction);
    ASSERT_TRUE(t.has_value());
    // A grazing hit moves by the root of the rounding.
    EXPECT_LE(*t, 1.0 + 1e-6);
    const Eigen::Vector3d hit = origin + *t * direction;
    EXPECT_NEAR(implicitValue(patch, hit), 0.0, kRounding);
    EXPECT_GE(normalAt(patch, 0, 0)->dot(-implicitGradient(patch, hit)), -1e-6);
  }
}

TEST_P(Surface, RayOutsideTheBoundaryMisses)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector2d xy =
        random.uniform(1.001, 1.1) * boundaryPoint(patch, random.uniform(0.0, 3.999));
    const Eigen::Vector3d origin = patch.pose().toWorld({xy.x(), xy.y(), 1.0});
    EXPECT_FALSE(intersectRay(patch, origin, -patch.normal()));
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Surface,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

Patch
unitPatch(SurfaceType surface, double kappa, double d)
{
  Patch patch;
  patch.type = {surface, defaultBoundary(surface)};
  patch.d.head(boundaryParameterCount(patch.type.boundary)).setConstant(d);
  patch.kappa.x() = kappa;
  return patch;
}

TEST(RoundSurfaces, EndAtTheEquator)
{
  for (const SurfaceType surface :
       {SurfaceType::Sphere, SurfaceType::CircularCylinder}) {
    for (const double kappa : {-5.0, 5.0}) {
      const Patch patch = unitPatch(surface, kappa, 0.5);
      // The centre of curvature is 1 / kappa above.
      EXPECT_NEAR(height(patch, 0.0, 0.2).value(), 1.0 / kappa, 1e-12);
      EXPECT_NEAR(normalAt(patch, 0.0, 0.2)->z(), 0.0, 1e-6);
      EXPECT_FALSE(height(patch, 0.0, 0.2001));
      EXPECT_FALSE(normalAt(patch, 0.0, 0.2001));
    }
  }
}

TEST(RoundSurfaces, RaysPassThroughTheFarSheet)
{
  for (const SurfaceType surface :
       {SurfaceType::Sphere, SurfaceType::CircularCylinder}) {
    // A bowl of radius 0.2: from above, the ray enters through the missing upper half.
    const Patch bowl = unitPatch(surface, 5.0, 0.15);
    const auto t = intersectRay(bowl, {0.0, 0.1, 1.0}, {0.0, 0.0, -1.0});
    ASSERT_TRUE(t.has_value());
    EXPECT_NEAR(*t, 1.0 - (0.2 - std::sqrt(0.03)), kRounding);
    // From below, a dome's missing lower half.
    const Patch dome = unitPatch(surface, -5.0, 0.15);
    EXPECT_NEAR(intersectRay(dome, {0.0, 0.0, -1.0}, {0.0, 0.0, 1.0}).value(),
                1.0,
                kRounding);
  }
}

TEST(Rays, ParallelToAPlaneMiss)
{
  const Patch plane = unitPatch(SurfaceType::Plane, 0.0, 0.1);
  EXPECT_FALSE(intersectRay(plane, {-1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}));
  EXPECT_FALSE(intersectRay(plane, {-1.0, 0.0, 0.1}, {1.0, 0.0, 0.0}));
  EXPECT_FALSE(intersectRay(plane, {0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}));
}

TEST(Rays, AlongTheAxisOfAParaboloidHitOnce)
{
  const Patch dish = unitPatch(SurfaceType::CircularParaboloid, 4.0, 0.1);
  const auto t = intersectRay(dish, {0.05, 0.0, 1.0}, {0.0, 0.0, -2.0});
  EXPECT_NEAR(t.value(), 0.5 * (1.0 - 0.005), kRounding);
}

TEST(Rays, AcrossABowlHitTheNearerWall)
{
  const Patch dish = unitPatch(SurfaceType::CircularParaboloid, 4.0, 0.1);
  const Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  // z = 2 x^2 = 0.0128 at x = -+0.08.
  EXPECT_NEAR(intersectRay(dish, {-1.0, 0.0, 0.0128}, direction).value(), 0.92, 1e-12);
  EXPECT_NEAR(intersectRay(dish, {0.0, 0.0, 0.0128}, direction).value(), 0.08, 1e-12);
  EXPECT_FALSE(intersectRay(dish, {0.09, 0.0, 0.0128}, direction));
}

TEST(Rays, FromThePatchItselfStartAtZero)
{
  const Patch dish = unitPatch(SurfaceType::CircularParaboloid, 4.0, 0.1);
  EXPECT_EQ(intersectRay(dish, {0, 0, 0}, {0, 0, -1}), 0.0);
  EXPECT_EQ(intersectRay(dish, {0, 0, 0}, {1, 0, 0}), 0.0);
}

}} // namespace holdfast
