// The same points as FLANN's tree finds, in every kind of cloud.
#include "pcl/ball_grid.h"

#include "support/random.h"

#include <pcl/kdtree/kdtree_flann.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace holdfast { namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr
blob(test::Random& random, int n, const Eigen::Vector3d& middle, double size)
{
  auto cloud = pcl::make_shared<Cloud>();
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d q(random.normal(), random.normal(), 0.1 * random.normal());
    pcl::PointXYZ p;
    p.getVector3fMap() = (middle + size * q).cast<float>();
    cloud->push_back(p);
  }
  return cloud;
}

std::vector<int>
everyOther(const Cloud& cloud)
{
  std::vector<int> valid;
  for (int i = 0; i < static_cast<int>(cloud.size()); i += 2)
    valid.push_back(i);
  return valid;
}

void
expectSameAsTree(const Cloud::ConstPtr& cloud,
                 const std::vector<int>& valid,
                 double edge,
                 const std::vector<double>& radii)
{
  const BallGrid grid(*cloud, valid, edge);
  pcl::KdTreeFLANN<pcl::PointXYZ> tree(false);
  tree.setInputCloud(cloud, pcl::make_shared<pcl::Indices>(valid.begin(), valid.end()));
  std::vector<int> found;
  pcl::Indices expected;
  std::vector<float> distances;
  std::size_t sum = 0;
  for (std::size_t i = 0; i < cloud->size(); i += 1 + cloud->size() / 200)
    for (const double radius : radii) {
      grid.search((*cloud)[i], radius, found);
      tree.radiusSearch((*cloud)[i], radius, expected, distances);
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(found, std::vector<int>(expected.begin(), expected.end()))
          << "point " << i << ", radius " << radius;
      sum += found.size();
    }
  EXPECT_GT(sum, 0U);
}

TEST(BallGrid, FindsWhatTheTreeFinds)
{
  for (std::uint64_t i = 0; i < 20; ++i) {
    test::Random random(i);
    const Eigen::Vector3d middle(random.uniform(-50.0, 50.0), random.normal(), 3.0);
    const auto cloud = blob(random, 3000, middle, random.uniform(0.1, 3.0));
    const double edge = random.uniform(0.05, 0.3);
    expectSameAsTree(cloud,
                     everyOther(*cloud),
                     edge,
                     {0.3 * edge, edge, 1.2 * edge, 7.0 * edge});
  }
}

// Many points just at the radius, and on the faces of the cubes.
TEST(BallGrid, PointsOnALattice)
{
  auto cloud = pcl::make_shared<Cloud>();
  for (int i = 0; i < 8000; ++i)
    cloud->push_back(pcl::PointXYZ(0.1F * static_cast<float>(i % 20 - 10),
                                   0.1F * static_cast<float>(i / 20 % 20 - 10),
                                   0.1F * static_cast<float>(i / 400 - 10)));
  std::vector<int> all(cloud->size());
  std::iota(all.begin(), all.end(), 0);
  expectSameAsTree(cloud, all, 0.1, {0.1, 0.2, 0.1 * std::sqrt(2.0), 0.3, 100.0});
  expectSameAsTree(cloud, all, 0.2, {0.1, 0.2, 0.5});
}

TEST(BallGrid, CloudsFarOutAndRadiiBeyondAllSizes)
{
  test::Random random;
  const auto cloud = blob(random, 500, {3e4, -2e5, 100.0}, 0.5);
  expectSameAsTree(cloud, everyOther(*cloud), 1e-9, {0.2, 10.0});
  expectSameAsTree(cloud, everyOther(*cloud), 1e6, {0.2, 10.0});
  expectSameAsTree(cloud, everyOther(*cloud), 1e-320, {0.2, 10.0});
}

TEST(BallGrid, NothingIsFoundInNothing)
{
  const Cloud cloud;
  std::vector<int> found{1, 2};
  BallGrid(cloud, {}, 0.1).search(pcl::PointXYZ(0.0F, 0.0F, 0.0F), 1.0, found);
  EXPECT_TRUE(found.empty());
}

}} // namespace holdfast
