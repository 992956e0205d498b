// The same points as looking at all of them finds, in every kind of cloud.
#include "pcl/nearest_points.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace holdfast { namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

std::vector<int>
byBruteForce(const Cloud& cloud, std::vector<int> valid, int centre, std::size_t k)
{
  const auto squared = [&](int i) {
    float sum = 0.0F;
    for (int axis = 0; axis < 3; ++axis) {
      const float d = cloud[i].data[axis] - cloud[centre].data[axis];
      sum += d * d;
    }
    return sum;
  };
  std::stable_sort(valid.begin(), valid.end(), [&](int a, int b) {
    return squared(a) < squared(b);
  });
  valid.resize(std::min(k, valid.size()));
  std::sort(valid.begin(), valid.end());
  return valid;
}

void
expectAsByBruteForce(const Cloud& cloud, const std::vector<int>& valid)
{
  const NearestPoints tree(cloud, valid);
  std::vector<PathEnd> heap;
  std::vector<int> found;
  const auto points = static_cast<int>(cloud.size());
  for (int centre = 0; centre < points; centre += 1 + points / 50)
    for (const std::size_t k : {0U, 1U, 2U, 9U, 100U, 5000U}) {
      tree.search(cloud[centre], k, heap, found);
      std::sort(found.begin(), found.end());
      ASSERT_EQ(found, byBruteForce(cloud, valid, centre, k))
          << "point " << centre << ", k " << k;
    }
}

std::vector<int>
allOf(const Cloud& cloud)
{
  std::vector<int> indices(cloud.size());
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

TEST(NearestPoints, OfBlobs)
{
  for (std::uint64_t c = 0; c < 6; ++c) {
    test::Random random(c);
    Cloud cloud;
    for (int i = random.integer(1, 3000); i > 0; --i)
      cloud.push_back(pcl::PointXYZ(static_cast<float>(random.normal()),
                                    static_cast<float>(random.normal()),
                                    static_cast<float>(0.01 * random.normal())));
    std::vector<int> valid = allOf(cloud);
    expectAsByBruteForce(cloud, valid);
    valid.erase(
        std::remove_if(valid.begin(), valid.end(), [](int i) { return i % 3 == 0; }),
        valid.end());
    expectAsByBruteForce(cloud, valid);
  }
}

TEST(NearestPoints, OfEquallyFarOnesAreTheFirst)
{
  Cloud lattice;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      for (int k = 0; k < 3; ++k)
        lattice.push_back(pcl::PointXYZ(static_cast<float>(j),
                                        static_cast<float>(i),
                                        static_cast<float>(k)));
  expectAsByBruteForce(lattice, allOf(lattice));
}

TEST(NearestPoints, OfOnePlaceAreTheFirst)
{
  Cloud same;
  for (int i = 0; i < 200; ++i)
    same.push_back(pcl::PointXYZ(1.0F, 2.0F, 3.0F));
  expectAsByBruteForce(same, allOf(same));
}

TEST(NearestPoints, OfNothingAreNone)
{
  std::vector<PathEnd> heap;
  std::vector<int> found{7};
  NearestPoints().search(pcl::PointXYZ(), 3, heap, found);
  EXPECT_TRUE(found.empty());
}

}} // namespace holdfast
