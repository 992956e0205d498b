// The batch keeps what it was given, whatever its history, and drops what no fit can
// use.
#include "support/random.h"

#include <holdfast/fit/point_batch.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace holdfast { namespace {

using test::Random;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Matrix3d
randomCovariance(Random& random)
{
  const Eigen::Matrix3d R = random.rotation();
  const Eigen::Vector3d sigma = random.uniformVector(1e-3, 4e-3);
  const Eigen::Matrix3d S = R * sigma.cwiseAbs2().asDiagonal() * R.transpose();
  return 0.5 * (S + S.transpose());
}

TEST(PointBatch, GivesBackWhatWasAdded)
{
  Random random;
  PointBatch batch;
  const Eigen::Vector3d origin(3.0, -2.0, 5.0);
  for (int round = 0; round < 3; ++round) {
    batch.clear(origin);
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Matrix3d> covariances;
    for (int i = 0; i < 50 * (round + 1); ++i) {
      points.push_back(origin + random.uniformVector(-0.1, 0.1));
      covariances.push_back(randomCovariance(random));
      batch.add(points.back(), covariances.back());
    }
    ASSERT_EQ(batch.size(), static_cast<int>(points.size()));
    for (int i = 0; i < batch.size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      // Coordinates are rounded at the size of the origin once.
      EXPECT_LT((batch.point(i) - points[at]).norm(), 2e-15);
      EXPECT_EQ(batch.covariance(i), covariances[at]);
      EXPECT_EQ(batch.channel(PointBatch::W)[i], 1.0);
    }
  }
}

TEST(PointBatch, PaddingHasNoWeightAndNoCovariance)
{
  Random random;
  PointBatch batch;
  for (int n = 1; n <= 40; ++n) {
    batch.clear(Eigen::Vector3d::Zero());
    for (int i = 0; i < n; ++i)
      batch.add(random.normalVector(), randomCovariance(random));
    batch.pad();
    EXPECT_EQ(batch.size(), n);
    EXPECT_EQ(batch.paddedSize() % PointBatch::kLaneMultiple, 0);
    EXPECT_LT(batch.paddedSize() - n, PointBatch::kLaneMultiple);
    for (int i = n; i < batch.paddedSize(); ++i) {
      EXPECT_EQ(batch.channel(PointBatch::W)[i], 0.0);
      EXPECT_EQ(batch.covariance(i), Eigen::Matrix3d::Zero().eval());
      EXPECT_TRUE(batch.point(i).allFinite());
    }
  }
}

// Points written after pad() must have their weight again.
TEST(PointBatch, GrowsOverItsPadding)
{
  Random random;
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  for (int i = 0; i < 13; ++i) {
    batch.add(random.normalVector(), randomCovariance(random));
    batch.pad();
    for (int k = 0; k <= i; ++k)
      EXPECT_EQ(batch.channel(PointBatch::W)[k], 1.0);
  }
  batch.resize(16);
  EXPECT_EQ(batch.channel(PointBatch::W)[15], 1.0);
}

TEST(PointBatch, ChannelsAreAlignedForTheWidestVectors)
{
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  for (const int n : {1, 9, 17, 200}) {
    batch.resize(n);
    batch.pad();
    for (int c = 0; c < PointBatch::kChannels; ++c) {
      const double* channel = batch.channel(static_cast<PointBatch::Channel>(c));
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(channel) % 64, 0U);
    }
  }
}

TEST(PointBatch, DropsWhatIsNotFiniteOrNotPositiveSemiDefinite)
{
  Random random;
  const Eigen::Matrix3d good = randomCovariance(random);
  std::vector<std::pair<Eigen::Vector3d, Eigen::Matrix3d>> bad;
  for (int k = 0; k < 3; ++k)
    for (const double value : {kNan, kInfinity, -kInfinity}) {
      Eigen::Vector3d point(0.1, 0.2, 0.3);
      point[k] = value;
      bad.emplace_back(point, good);
    }
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      for (const double value : {kNan, kInfinity, 1.0}) {
        Eigen::Matrix3d S = good;
        S(i, j) = S(j, i) = i == j && value == 1.0 ? -value : value;
        bad.emplace_back(Eigen::Vector3d::Ones(), S);
      }
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  int kept = 0;
  for (const auto& [point, covariance] : bad) {
    batch.add(point, covariance);
    batch.add(Eigen::Vector3d(kept++, 0.0, 0.0), good);
  }
  EXPECT_EQ(batch.removeInvalid(), static_cast<int>(bad.size()));
  ASSERT_EQ(batch.size(), kept);
  // In their order, and no more to drop.
  for (int i = 0; i < kept; ++i)
    EXPECT_EQ(batch.point(i).x(), i);
  EXPECT_EQ(batch.removeInvalid(), 0);
}

TEST(PointBatch, InfinitiesOfOppositeSignDoNotCancel)
{
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  batch.add({kInfinity, -kInfinity, 0.0}, Eigen::Matrix3d::Identity());
  EXPECT_EQ(batch.removeInvalid(), 1);
}

TEST(PointBatch, KeepsSingularCovariances)
{
  Random random;
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  batch.add(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero());
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d ray = random.normalVector();
    const Eigen::Matrix3d S = ray * ray.transpose();
    // As read from a file: in single precision, not quite positive any more.
    batch.add(Eigen::Vector3d::Zero(), S.cast<float>().eval().cast<double>());
  }
  EXPECT_EQ(batch.removeInvalid(), 0);
}

TEST(PointBatch, DropsWhatCannotInformBesideTheOthers)
{
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(i);
    PointBatch batch;
    batch.clear(Eigen::Vector3d::Zero());
    const int typical = random.integer(1, 40);
    const int poor = random.integer(0, typical - 1); // less than half
    std::vector<bool> is_poor(static_cast<std::size_t>(typical + poor), false);
    std::fill_n(is_poor.begin(), poor, true);
    std::shuffle(is_poor.begin(), is_poor.end(), random.engine());
    std::vector<double> expected;
    for (const bool p : is_poor) {
      // Sigmas within a factor of three of each other, or ten times the largest.
      const double sigma = p ? random.uniform(30.1, 1e4) : random.uniform(1.0, 3.0);
      batch.add({static_cast<double>(batch.size()), 0.0, 0.0},
                sigma * sigma * Eigen::Matrix3d::Identity());
      if (!p)
        expected.push_back(batch.size() - 1);
    }
    EXPECT_EQ(batch.removeUninformative(), poor);
    ASSERT_EQ(batch.size(), typical);
    for (int k = 0; k < typical; ++k)
      EXPECT_EQ(batch.point(k).x(), expected[static_cast<std::size_t>(k)]);
  }
}

TEST(PointBatch, KeepsAllWhereTheNoiseVariesAsOfASensor)
{
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(i);
    PointBatch batch;
    batch.clear(Eigen::Vector3d::Zero());
    const int count = random.integer(0, 40);
    for (int k = 0; k < count; ++k) {
      const double sigma = random.uniform(1e-3, 9.9e-3);
      batch.add(Eigen::Vector3d::Zero(), sigma * sigma * Eigen::Matrix3d::Identity());
    }
    EXPECT_EQ(batch.removeUninformative(), 0);
    EXPECT_EQ(batch.size(), count);
  }
}

TEST(PointBatch, TheFloorLiftsOnlyWhatIsBelowIt)
{
  constexpr double kFloor = 1e-3;
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  const Eigen::Matrix3d above = 1.01e-6 / 3.0 * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d below = 0.99e-6 / 3.0 * Eigen::Matrix3d::Identity();
  for (const Eigen::Matrix3d& S : {above, below, Eigen::Matrix3d::Zero().eval()})
    batch.add(Eigen::Vector3d::Zero(), S);
  batch.applyFloor(kFloor);
  const Eigen::Matrix3d floor = kFloor * kFloor * Eigen::Matrix3d::Identity();
  EXPECT_EQ(batch.covariance(0), above);
  EXPECT_EQ(batch.covariance(1), below + floor);
  EXPECT_EQ(batch.covariance(2), floor);
}

}} // namespace holdfast
