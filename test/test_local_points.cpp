// Points placed about a patch all at once lie where they do one by one.
#include "support/random_patch.h"

#include "validation/local_points.h"
#include "validation/patch_rays.h"

#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>

#include <cmath>
#include <limits>

namespace holdfast { namespace {

using test::Random;
using test::randomPatch;

constexpr std::uint64_t kCases = 30;

// Coordinates of a metre, subtracted and turned.
constexpr double kRounding = 1e-14;

class PlacedPoints : public testing::TestWithParam<PatchType> {};

std::vector<Eigen::Vector3d>
pointsAround(Random& random, const Patch& patch, int count)
{
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i)
    points.push_back(patch.c + random.uniformVector(-0.2, 0.2));
  return points;
}

TEST_P(PlacedPoints, AreWhereTheyAreOneByOne)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const auto points = pointsAround(random, patch, static_cast<int>(1 + i));
    const LocalPoints placed(patch, points);
    ASSERT_EQ(placed.size(), static_cast<int>(points.size()));
    for (int k = 0; k < placed.size(); ++k) {
      const Eigen::Vector3d& point = points[static_cast<std::size_t>(k)];
      const Eigen::Vector3d local = patch.pose().toLocal(point);
      EXPECT_LT((placed[k] - local).norm(), kRounding);
      EXPECT_EQ(placed.isInside(k), contains(patch, local.head<2>()));
      EXPECT_NEAR(std::sqrt(placed.squaredDistance(k)),
                  std::abs(approximateDistanceToSurface(patch, point)),
                  kRounding);
    }
  }
}

TEST_P(PlacedPoints, OfABatchAreThoseOfAList)
{
  Random random(7);
  const Patch patch = randomPatch(random, GetParam());
  const auto points = pointsAround(random, patch, 21);
  PointBatch batch;
  batch.clear(points[3]);
  for (const Eigen::Vector3d& point : points)
    batch.add(point, Eigen::Matrix3d::Identity());
  std::vector<Eigen::Vector3d> of_list;
  const LocalPoints list(patch, points);
  for (int i = 0; i < list.size(); ++i)
    of_list.push_back(list[i]);
  const LocalPoints placed(patch, batch);
  ASSERT_EQ(placed.size(), static_cast<int>(of_list.size()));
  for (int i = 0; i < placed.size(); ++i)
    EXPECT_LT((placed[i] - of_list[static_cast<std::size_t>(i)]).norm(), kRounding);
}

TEST_P(PlacedPoints, AreTheFiniteOnesEachWithItsOwn)
{
  Random random(8);
  const Patch patch = randomPatch(random, GetParam());
  const auto points = pointsAround(random, patch, 20);
  auto some = points;
  some[4].z() = std::numeric_limits<double>::quiet_NaN();
  some[11].x() = std::numeric_limits<double>::infinity();
  some.erase(some.begin() + 15);
  const LocalPoints placed(patch, some);
  ASSERT_EQ(placed.size(), 17);
  for (int i = 0, k = 0; i < 20; ++i) {
    if (i == 4 || i == 11 || i == 15)
      continue;
    const Eigen::Vector3d local =
        patch.pose().toLocal(points[static_cast<std::size_t>(i)]);
    EXPECT_LT((placed[k] - local).norm(), kRounding);
    EXPECT_EQ(placed.isInside(k), contains(patch, local.head<2>()));
    ++k;
  }
}

// A point out of all proportion counts, whatever overflows.
TEST_P(PlacedPoints, FarAwayAreNotLost)
{
  Random random(9);
  const Patch patch = randomPatch(random, GetParam());
  const std::vector<Eigen::Vector3d> points = {patch.c, {1e200, 1e200, -1e200}};
  EXPECT_EQ(LocalPoints(patch, points).size(), 2);
}

// Seen from anywhere, as intersectRay() has it.
TEST_P(PlacedPoints, RaysMeetThePatchAsOneByOne)
{
  int met = 0, missed = 0;
  PatchRays rays;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    Pose camera;
    camera.R = random.rotation();
    camera.c = patch.c - camera.R * random.uniformVector(0.1, 1.0);
    std::vector<Eigen::Vector3d> directions;
    rays.clear();
    for (int k = 0; k < 37; ++k) {
      const Eigen::Vector3d to =
          camera.toLocal(patch.c + random.uniformVector(-0.1, 0.1));
      directions.push_back(camera.R * (to / to.z()));
      rays.add(to.x() / to.z(), to.y() / to.z(), 1.0);
    }
    const std::vector<double>& inverse = rays.meet(patch, camera);
    ASSERT_EQ(inverse.size(), directions.size());
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const auto t = intersectRay(patch, camera.c, directions[k]);
      EXPECT_NEAR(inverse[k], t ? 1.0 / *t : 0.0, 1e-10 * std::max(1.0, inverse[k]));
      ++(t ? met : missed);
    }
  }
  EXPECT_GT(met, 0);
  EXPECT_GT(missed, 0);
}

TEST(PatchRays, StrayWhereTheyMeasuredSomethingElse)
{
  Patch plane;
  plane.type = {SurfaceType::Plane, BoundaryType::Circle};
  plane.c = {0.0, 0.0, 2.0};
  plane.d[0] = 0.1;
  PatchRays rays;
  for (const double inverse : {0.5, 0.5, 0.5, 0.4})
    rays.add(0.0, 0.0, inverse);
  rays.add(0.2, 0.0, 3.0); // beside the patch
  EXPECT_EQ(rays.strayShare(plane, Pose(), 0.05), 0.25);
  rays.clear();
  EXPECT_EQ(rays.strayShare(plane, Pose(), 0.05), 0.0);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         PlacedPoints,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
