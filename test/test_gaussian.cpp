// Eigen reports allocations through its assertions; here they throw.
#include <stdexcept>
#define EIGEN_RUNTIME_NO_MALLOC
#define eigen_assert(condition)           \
  do {                                    \
    if (!(condition))                     \
      throw std::logic_error(#condition); \
  } while (false)

#include "support/random.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/patch/parameters.h>

#include <cmath>
#include <limits>

namespace holdfast { namespace {

using test::Random;

// A dozen products of numbers about 1.
constexpr double kRounding = 1e-13;

// A random covariance of the given size and rank, trace about its rank.
ParameterMatrix
randomCovariance(Random& random, int size, int rank)
{
  ParameterMatrix A = ParameterMatrix::Zero(size, rank);
  for (int i = 0; i < size; ++i)
    for (int j = 0; j < rank; ++j)
      A(i, j) = random.normal() / size;
  return A * A.transpose();
}

TEST(Gaussian, PropagateIsTheCongruence)
{
  Random random;
  const ParameterMatrix Sigma = randomCovariance(random, 7, 7);
  Eigen::Matrix<double, 3, 7> J;
  for (int i = 0; i < J.size(); ++i)
    J(i) = random.normal();
  const Eigen::Matrix3d result = propagate(J, Sigma);
  EXPECT_LT((result - J * Sigma * J.transpose()).norm(), kRounding);
  EXPECT_EQ(result, result.transpose());
}

TEST(Gaussian, SymmetrizedAveragesWithTheTranspose)
{
  Eigen::Matrix3d A;
  A << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  Eigen::Matrix3d expected;
  expected << 1, 3, 5, 3, 5, 7, 5, 7, 9;
  EXPECT_EQ(symmetrized(A), expected);
}

TEST(Gaussian, CovariancesOfAnyRankAndScaleAreSemiDefinite)
{
  for (int rank = 0; rank <= 8; ++rank) {
    Random random(static_cast<std::uint64_t>(rank));
    const ParameterMatrix Sigma = randomCovariance(random, 8, rank);
    for (const double scale : {1e-300, 1e-12, 1.0, 1e12, 1e300})
      EXPECT_TRUE(isPositiveSemiDefinite(scale * Sigma)) << rank << " x " << scale;
  }
  EXPECT_TRUE(isPositiveSemiDefinite(ParameterMatrix()));
}

TEST(Gaussian, SinglePrecisionRoundingIsForgiven)
{
  Random random;
  const ParameterMatrix Sigma = randomCovariance(random, 6, 2);
  EXPECT_TRUE(isPositiveSemiDefinite(Sigma.cast<float>().cast<double>()));
}

TEST(Gaussian, OtherMatricesAreNotSemiDefinite)
{
  Eigen::Matrix3d A = Eigen::Vector3d(1.0, 1.0, -1e-4).asDiagonal();
  EXPECT_FALSE(isPositiveSemiDefinite(A));
  EXPECT_FALSE(isPositiveSemiDefinite(Eigen::Matrix3d(-Eigen::Matrix3d::Identity())));
  A = Eigen::Matrix3d::Identity();
  A(0, 1) = 1e-3;
  EXPECT_FALSE(isPositiveSemiDefinite(A)) << "not symmetric";
  A(0, 1) = A(1, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(isPositiveSemiDefinite(A));
  A(0, 1) = A(1, 0) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(isPositiveSemiDefinite(A));
  EXPECT_FALSE(isPositiveSemiDefinite(ParameterMatrix::Zero(2, 3)));
}

TEST(Gaussian, SquareRootSquaresToTheCovariance)
{
  for (int rank = 0; rank <= 8; ++rank) {
    Random random(static_cast<std::uint64_t>(rank));
    const ParameterMatrix Sigma = randomCovariance(random, 8, rank);
    const ParameterMatrix S = squareRoot(Sigma);
    EXPECT_LT((S * S.transpose() - Sigma).norm(), kRounding);
    EXPECT_LT((S - S.transpose()).norm(), kRounding);
  }
  EXPECT_EQ(squareRoot(ParameterMatrix()).size(), 0);
}

TEST(Gaussian, SquareRootTakesRoundingBelowZeroAsZero)
{
  const Eigen::Matrix3d Sigma = Eigen::Vector3d(4.0, 1.0, -1e-17).asDiagonal();
  const Eigen::Matrix3d expected = Eigen::Vector3d(2.0, 1.0, 0.0).asDiagonal();
  EXPECT_LT((squareRoot(Sigma) - expected).norm(), kRounding);
}

TEST(Gaussian, SamplesHaveTheMeanAndCovariance)
{
  Random random;
  const Eigen::Vector3d mean(1.0, -2.0, 3.0);
  Eigen::Matrix3d Sigma;
  Sigma << 2.0, 0.5, -0.3, 0.5, 1.0, 0.2, -0.3, 0.2, 0.5;
  const Eigen::Matrix3d root = squareRoot(Sigma);
  constexpr int kSamples = 100000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3d x = sampleGaussian(mean, root, random.engine()) - mean;
    sum += x;
    scatter += x * x.transpose();
  }
  // Five sigmas of the largest entries: sqrt(2 / n) for a mean, 2 sqrt(2 / n) for a
  // variance of 2.
  EXPECT_LT((sum / kSamples).cwiseAbs().maxCoeff(), 5 * std::sqrt(2.0 / kSamples));
  EXPECT_LT((scatter / kSamples - Sigma).cwiseAbs().maxCoeff(),
            10 * std::sqrt(2.0 / kSamples));
}

TEST(Gaussian, SameSeedGivesTheSameSamples)
{
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d root = Eigen::Matrix3d::Identity();
  Random a(1);
  Random b(1);
  EXPECT_EQ(sampleGaussian(zero, root, a.engine()),
            sampleGaussian(zero, root, b.engine()));
}

TEST(Gaussian, ParameterMatricesNeverTouchTheHeap)
{
  Random random;
  const ParameterMatrix Sigma = randomCovariance(random, kMaxParameters, 8);
  const ParameterMatrix J = randomCovariance(random, kMaxParameters, 11);
  const ParameterVector mean = ParameterVector::Zero(kMaxParameters);
  const auto use_all = [&] {
    const ParameterMatrix moved = propagate(J, Sigma);
    const ParameterMatrix root = squareRoot(symmetrized(moved));
    const ParameterVector sample = sampleGaussian(mean, root, random.engine());
    return isPositiveSemiDefinite(moved) && sample.allFinite();
  };
  Eigen::internal::set_is_malloc_allowed(false);
  EXPECT_NO_THROW(EXPECT_TRUE(use_all()));
  Eigen::internal::set_is_malloc_allowed(true);
}

}} // namespace holdfast
