#include "support/random_patch.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/patch/boundary.h>

#include <cmath>
#include <limits>

namespace holdfast { namespace {

using test::Random;
using test::randomPatch;

constexpr std::uint64_t kCases = 30;

class Boundary : public testing::TestWithParam<PatchType> {};

double
polygonArea(const std::vector<Eigen::Vector2d>& polygon)
{
  double doubled = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    doubled += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * doubled;
}

bool
isPolygon(BoundaryType boundary)
{
  return boundary == BoundaryType::Rectangle || boundary == BoundaryType::Quad;
}

TEST_P(Boundary, ContainsWhatLiesWithinAndOnIt)
{
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector2d edge = boundaryPoint(patch, random.uniform(0.0, 3.999));
    EXPECT_TRUE(contains(patch, edge));
    EXPECT_TRUE(contains(patch, random.uniform(0.0, 1.0) * edge));
    EXPECT_FALSE(contains(patch, (1.0 + 1e-9) * edge));
    EXPECT_FALSE(contains(patch, random.uniform(1.001, 5.0) * edge));
  }
}

TEST_P(Boundary, ContainsNothingThatIsNotANumber)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(contains(patch, {nan, 0.0}));
  EXPECT_FALSE(contains(patch, {0.0, nan}));
}

TEST_P(Boundary, AreaIsTheShareOfPointsWithin)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  constexpr int kSamples = 100000;
  int within = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double x = random.uniform(-0.15, 0.15);
    within += contains(patch, {x, random.uniform(-0.15, 0.15)}) ? 1 : 0;
  }
  const double share = projectedArea(patch) / (0.3 * 0.3);
  // Five sigmas of a binomial share, at most 0.5 / sqrt(n) each.
  EXPECT_NEAR(within / double(kSamples), share, 2.5 / std::sqrt(kSamples));
}

TEST_P(Boundary, OutlineIsCounterClockwiseWithEdgesNoLongerThanTheSpacing)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const double spacing = random.uniform(0.002, 0.05);
    const auto polygon = outline(patch, spacing);
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Eigen::Vector2d& a = polygon[k];
      const Eigen::Vector2d& b = polygon[(k + 1) % polygon.size()];
      EXPECT_TRUE(contains(patch, a));
      EXPECT_FALSE(contains(patch, (1.0 + 1e-9) * a));
      EXPECT_LE((b - a).norm(), spacing * (1.0 + 1e-12));
      EXPECT_GT((b - a).norm(), 0.0);
      EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0.0);
    }
  }
}

TEST_P(Boundary, OutlineEnclosesTheArea)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const double area = projectedArea(patch);
    const auto polygon = outline(patch, 1e-3);
    // A polygon of n corners at equal steps of the angle fills this share of an
    // ellipse.
    const double step = 2.0 * kPi / static_cast<double>(polygon.size());
    const double share = isPolygon(GetParam().boundary) ? 1.0 : std::sin(step) / step;
    EXPECT_NEAR(polygonArea(polygon) / area, share, 1e-12);
  }
}

TEST_P(Boundary, CoarseOutlineKeepsItsShape)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  const auto polygon = outline(patch, 100.0);
  EXPECT_EQ(polygon.size(), isPolygon(GetParam().boundary) ? 4u : 8u);
  EXPECT_EQ(outline(patch, std::numeric_limits<double>::infinity()), polygon);
}

TEST_P(Boundary, SpacingThatIsNotPositiveIsMisuse)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e-12})
    EXPECT_THROW(outline(patch, bad), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Boundary,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

TEST(QuadBoundary, CornersLieOnTheDiagonalsInTheirQuadrants)
{
  Patch patch;
  patch.type = {SurfaceType::Plane, BoundaryType::Quad};
  patch.d << 0.12, 0.10, 0.11, 0.13, kPi / 6;
  const double gamma = patch.d(4);
  const double angles[] = {gamma, kPi - gamma, -kPi + gamma, -gamma};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d corner = boundaryPoint(patch, i);
    EXPECT_NEAR(corner.norm(), patch.d(i), 1e-15);
    EXPECT_NEAR(std::atan2(corner.y(), corner.x()), angles[i], 1e-14);
  }
}

TEST(RectangleBoundary, BoundsAreHalfLengths)
{
  Patch patch;
  patch.type = {SurfaceType::Plane, BoundaryType::Rectangle};
  patch.d.head<2>() << 0.2, 0.1;
  EXPECT_DOUBLE_EQ(projectedArea(patch), 0.08);
  EXPECT_TRUE(contains(patch, {0.2, -0.1}));
  EXPECT_FALSE(contains(patch, {0.2, 0.101}));
}

}} // namespace holdfast
