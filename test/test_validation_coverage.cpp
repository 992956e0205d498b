// The share of a patch that the points of its neighbourhood support.
#include "support/random_patch.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/validation/coverage.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast { namespace {

using test::Random;
using test::randomPatch;
using test::randomPose;

constexpr std::uint64_t kCases = 30;

using Points = std::vector<Eigen::Vector3d>;

// A world point on the surface over the local (x, y).
Eigen::Vector3d
lifted(const Patch& patch, const Eigen::Vector2d& xy)
{
  return patch.pose().toWorld(
      {xy.x(), xy.y(), height(patch, xy.x(), xy.y()).value_or(0.0)});
}

// About n points within the boundary, as the pixels of a camera put them that sees the
// local xy plane at an angle of `tilt` from its normal: a grid of any direction and
// offset, stretched by 1/cos(tilt) along one axis.
Points
seenAtTilt(Random& random, const Patch& patch, int n, double tilt)
{
  const double pitch = std::sqrt(projectedArea(patch) * std::cos(tilt) / n);
  const Eigen::Matrix2d turn =
      Eigen::Rotation2Dd(random.uniform(0.0, 2.0 * kPi)).toRotationMatrix();
  const double offset_x = random.uniform(0.0, 1.0), offset_y = random.uniform(0.0, 1.0);
  const int lines = static_cast<int>(0.25 / pitch) + 1;
  Points points;
  for (int i = -lines; i <= lines; ++i)
    for (int j = -lines; j <= lines; ++j) {
      const Eigen::Vector2d xy =
          turn * pitch * Eigen::Vector2d(i + offset_x, (j + offset_y) / std::cos(tilt));
      if (contains(patch, xy))
        points.push_back(lifted(patch, xy));
    }
  return points;
}

template <typename Predicate>
Points
without(Points points, Predicate&& removed)
{
  points.erase(std::remove_if(points.begin(), points.end(), removed), points.end());
  return points;
}

class Covered : public testing::TestWithParam<PatchType> {};

TEST_P(Covered, EvenlyFilledPatchIsWholeAtAnyTilt)
{
  for (std::uint64_t i = 0; i < 5 * kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const double tilt = random.uniform(0.0, 70.0 * kPi / 180.0);
    const Points points = seenAtTilt(random, patch, random.integer(80, 600), tilt);
    const Coverage coverage = measureCoverage(patch, points);
    EXPECT_EQ(coverage.share, 1.0) << "tilt " << tilt;
    EXPECT_EQ(coverage.covered_cells, coverage.cells);
    EXPECT_EQ(coverage.points_inside, static_cast<int>(points.size()));
    EXPECT_EQ(coverage.points_outside, 0);
    // There is a cell in the box for every eight points, and quads fill half of it.
    EXPECT_GE(coverage.cells, static_cast<int>(points.size()) / 20);
  }
}

TEST_P(Covered, HalfFilledPatchIsHalf)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    Patch patch = randomPatch(random, GetParam());
    if (GetParam().boundary == BoundaryType::Quad)
      patch.d.head<4>().setConstant(0.1); // halves of the same area
    const Pose pose = patch.pose();
    const double turn = random.uniform(0.0, 2.0 * kPi);
    const Eigen::Vector3d side =
        pose.R * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.0);
    const Points half =
        without(seenAtTilt(random, patch, 4000, 0.5),
                [&](const Eigen::Vector3d& q) { return side.dot(q - patch.c) < 0.0; });
    // Some 250 cells, 16 in each direction, up to 48 of 1 : 3; the cells on the line
    // between the halves are covered from a third on, which adds a third of a cell at
    // most along a diagonal.
    EXPECT_NEAR(measureCoverage(patch, half).share, 0.5, 0.06);
  }
}

TEST_P(Covered, NothingIsCoveredByNoPointsAndByPointsOutside)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  EXPECT_EQ(measureCoverage(patch, Points()).share, 0.0);
  EXPECT_EQ(measureCoverage(patch, PointBatch()).share, 0.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Coverage invalid = measureCoverage(patch, Points(20, {nan, 0.0, 0.0}));
  EXPECT_EQ(invalid.share, 0.0);
  EXPECT_EQ(invalid.points_inside + invalid.points_outside, 0);
  Points around;
  for (int k = 0; k < 100; ++k)
    around.push_back(lifted(patch,
                            random.uniform(1.01, 1.2) *
                                boundaryPoint(patch, random.uniform(0.0, 3.999))));
  const Coverage outside = measureCoverage(patch, around);
  EXPECT_EQ(outside.share, 0.0);
  EXPECT_EQ(outside.points_inside, 0);
  EXPECT_EQ(outside.points_outside, 100);
  EXPECT_GT(outside.cells, 0);
}

TEST_P(Covered, FallsAsPointsInsideAreRemoved)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    // With a size of their own, cells do not follow the points.
    CoverageOptions options;
    options.cell_size_m = random.uniform(0.01, 0.03);
    Points points = seenAtTilt(random, patch, 500, 0.5);
    double share = 1.0;
    while (!points.empty()) {
      const double less = measureCoverage(patch, points, options).share;
      EXPECT_LE(less, share);
      share = less;
      std::shuffle(points.begin(), points.end(), random.engine());
      points.resize(points.size() * 4 / 5);
    }
    EXPECT_LT(share, 0.3);
  }
}

TEST_P(Covered, MovesWithThePatch)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d hole =
        lifted(patch, 0.5 * boundaryPoint(patch, random.uniform(0.0, 3.999)));
    const Points points =
        without(seenAtTilt(random, patch, 400, 0.5),
                [&](const Eigen::Vector3d& q) { return (q - hole).norm() < 0.03; });
    Pose T = randomPose(random);
    // The axes of a revolute patch are those of its r_xy, and turn under rotation.
    if (isRevolute(GetParam()))
      T.R.setIdentity();
    Points moved;
    for (const Eigen::Vector3d& point : points)
      moved.push_back(T.toWorld(point));
    EXPECT_EQ(measureCoverage(transformed(patch, T), moved).share,
              measureCoverage(patch, points).share);
  }
}

TEST_P(Covered, BatchAndListAgree)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  Points points = seenAtTilt(random, patch, 300, 0.5);
  points.resize(points.size() / 2);
  PointBatch batch;
  batch.clear(points.front());
  for (const Eigen::Vector3d& point : points)
    batch.add(point, Eigen::Matrix3d::Identity());
  const Coverage of_list = measureCoverage(patch, points);
  const Coverage of_batch = measureCoverage(patch, batch);
  EXPECT_EQ(of_batch.share, of_list.share);
  EXPECT_EQ(of_batch.cells, of_list.cells);
  EXPECT_EQ(of_batch.points_inside, of_list.points_inside);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Covered,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

Patch
rectangle(double dx, double dy)
{
  Patch patch;
  patch.type = {SurfaceType::Plane, BoundaryType::Rectangle};
  patch.d.head<2>() << dx, dy;
  return patch;
}

// n points close to (x, y).
void
addCluster(Points& points, double x, double y, int n)
{
  for (int i = 0; i < n; ++i)
    points.push_back({x + 1e-4 * i, y, 0.0});
}

TEST(CoverageCells, AreCoveredFromTheShareOfTheExpectedPoints)
{
  const Patch patch = rectangle(0.1, 0.05);
  CoverageOptions options;
  options.cell_size_m = 0.05; // 4 x 2 cells
  options.points_per_cell = 9.0;
  Points points;
  addCluster(points, -0.075, -0.025, 3);
  addCluster(points, 0.075, 0.025, 30);
  addCluster(points, 0.025, -0.025, 2);
  const Coverage coverage = measureCoverage(patch, points, options);
  EXPECT_EQ(coverage.cells, 8);
  EXPECT_EQ(coverage.covered_cells, 2);
  EXPECT_EQ(coverage.share, 0.25);
  EXPECT_EQ(coverage.points_inside, 35);
}

TEST(CoverageCells, OnTheEdgeOfTheBoxCount)
{
  const Patch patch = rectangle(0.1, 0.05);
  CoverageOptions options;
  options.cell_size_m = 0.05;
  options.points_per_cell = 3.0;
  const Points corners{{0.1, 0.05, 0},
                       {0.1, -0.05, 0},
                       {-0.1, 0.05, 0},
                       {-0.1, -0.05, 0}};
  const Coverage coverage = measureCoverage(patch, corners, options);
  EXPECT_EQ(coverage.points_inside, 4);
  EXPECT_EQ(coverage.covered_cells, 4);
}

TEST(CoverageCells, WithTooManyPointsOutsideAreNotCovered)
{
  Random random;
  Patch patch;
  patch.type = {SurfaceType::Plane, BoundaryType::Circle};
  patch.d(0) = 0.1;
  CoverageOptions options;
  options.cell_size_m = 0.025;
  Points points = seenAtTilt(random, patch, 500, 0.0);
  ASSERT_EQ(measureCoverage(patch, points, options).share, 1.0);
  // Around the middle of the first quadrant, just beyond the circle.
  const double rim = 0.1 * std::sqrt(0.5) + 1e-4;
  addCluster(points, rim, rim, 5);
  EXPECT_EQ(measureCoverage(patch, points, options).share, 1.0);
  addCluster(points, rim, rim, 5);
  const Coverage coverage = measureCoverage(patch, points, options);
  EXPECT_EQ(coverage.covered_cells, coverage.cells - 1);
  EXPECT_EQ(coverage.points_outside, 10);
}

TEST(CoverageCells, DivideStripsAcrossOnly)
{
  Random random;
  const Patch strip = rectangle(0.5, 0.002);
  Points points;
  for (int i = 0; i < 80; ++i)
    points.push_back({(i + 0.5) / 80.0 - 0.5, random.uniform(-0.002, 0.002), 0.0});
  EXPECT_EQ(measureCoverage(strip, points).share, 1.0);
  EXPECT_EQ(measureCoverage(strip, points).cells, 10);
  points.resize(40);
  EXPECT_EQ(measureCoverage(strip, points).share, 0.6); // three of five cells
}

TEST(CoverageCells, AreNeverMoreThan32PerSide)
{
  Random random;
  const Patch patch = rectangle(0.1, 0.1);
  CoverageOptions options;
  options.cell_size_m = 1e-9;
  EXPECT_EQ(measureCoverage(patch, seenAtTilt(random, patch, 50000, 0.0)).cells, 1024);
  EXPECT_EQ(measureCoverage(patch, Points(), options).cells, 1024);
  options.cell_size_m = 1e9;
  EXPECT_EQ(measureCoverage(patch, Points(), options).cells, 1);
}

TEST(CoverageCells, DoNotCareForTheScaleOfThePatch)
{
  for (const double scale : {1e-6, 1.0, 1e6}) {
    Random random;
    Points points = seenAtTilt(random, rectangle(0.1, 0.05), 300, 0.5);
    for (Eigen::Vector3d& point : points)
      point *= scale;
    const Coverage coverage =
        measureCoverage(rectangle(0.1 * scale, 0.05 * scale), points);
    EXPECT_EQ(coverage.share, 1.0);
  }
}

TEST(CoverageOptionsCheck, NamesWhatIsWrong)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto error = [](double cell, double points, double fill, double spill) {
    CoverageOptions options;
    options.cell_size_m = cell;
    options.points_per_cell = points;
    options.min_fill = fill;
    options.max_spill = spill;
    return validityError(options);
  };
  EXPECT_EQ(validityError(CoverageOptions{}), "");
  EXPECT_EQ(error(0.01, 8, 0.3, 1), "");
  for (const double bad : {0.0, -1.0, nan}) {
    EXPECT_NE(error(bad, 8, 0.3, 1).find("cell_size_m"), std::string::npos);
    EXPECT_NE(error(0.01, bad, 0.3, 1).find("points_per_cell"), std::string::npos);
  }
  for (const double bad : {1.1, -0.1, nan})
    EXPECT_NE(error(0.01, 8, bad, 1).find("min_fill"), std::string::npos);
  for (const double bad : {-0.1, nan})
    EXPECT_NE(error(0.01, 8, 0.3, bad).find("max_spill"), std::string::npos);
  CoverageOptions options;
  options.min_fill = 2.0;
  EXPECT_THROW(measureCoverage(rectangle(0.1, 0.1), Points(), options),
               std::invalid_argument);
}

}} // namespace holdfast
