// Points placed about a patch all at once lie where they do one by one.
#include "support/random_patch.h"

#include "patch/patch_rays.h"
#include "validation/local_points.h"

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

// Rays to points of the patch meet it there; those beside it do not.
TEST_P(PlacedPoints, RaysMeetThePatchAsOneByOne)
{
  int met = 0;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Eigen::Vector3d origin = patch.c + random.uniformVector(-1.0, 1.0);
    const PatchRays rays(patch, origin);
    for (int k = 0; k < 10; ++k) {
      const Eigen::Vector3d direction =
          patch.c + random.uniformVector(-0.1, 0.1) - origin;
      const auto together = rays.meet(direction);
      EXPECT_EQ(together, intersectRay(patch, origin, direction));
      met += together.has_value();
    }
  }
  EXPECT_GT(met, 0);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         PlacedPoints,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
