// The paper's distances between patches, and covariances summed up by them.
#include "support/random_patch.h"

#include <holdfast/evaluation/metrics.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/SVD>
#include <gtest/gtest.h>

namespace holdfast { namespace {

using test::Random;

constexpr double kExact = 1e-12;

// Mean of the norm of n independent standard normals: sqrt(2) G((n+1)/2) / G(n/2).
double
chiMean(int n)
{
  return std::sqrt(2.0) * std::tgamma(0.5 * (n + 1)) / std::tgamma(0.5 * n);
}

Patch
turned(const Patch& patch, const Eigen::Vector3d& axis, double angle)
{
  Patch result = patch;
  result.r = logMap(expMap(angle * axis) * expMap(patch.r));
  return result;
}

class Metrics : public testing::TestWithParam<PatchType> {};

TEST_P(Metrics, OfAPatchToItselfAreZero)
{
  Random random;
  const Patch patch = test::randomPatch(random, GetParam());
  const PatchDistances distance = patchDistances(patch, patch);
  // The logarithm of a rotation that is the identity within rounding: about 1e-16.
  EXPECT_LT(distance.phi_6, kExact);
  EXPECT_LT(distance.phi_5, kExact);
  EXPECT_EQ(distance.phi_t, 0.0);
  EXPECT_EQ(distance.phi_k, 0.0);
  EXPECT_EQ(distance.phi_d, 0.0);
}

TEST(Metrics, RotationDistancesAreSpectralNormAndAngle)
{
  for (const double angle : {1e-9, 1e-3, 0.5, 2.0, 3.1}) {
    Random random(static_cast<std::uint64_t>(1e9 * angle));
    Patch p = test::randomPatch(random, kPatchTypes[0]);
    const Patch s = turned(p, random.unitVector(), angle);
    const PatchDistances distance = patchDistances(p, s);
    const Eigen::Matrix3d difference =
        Eigen::Matrix3d::Identity() - expMap(p.r) * expMap(s.r).transpose();
    const double spectral_norm =
        Eigen::JacobiSVD<Eigen::Matrix3d>(difference).singularValues()[0];
    EXPECT_NEAR(distance.phi_6, angle, kExact);
    EXPECT_NEAR(distance.phi_5, spectral_norm, kExact);
    EXPECT_NEAR(distance.phi_5, 2.0 * std::sin(0.5 * angle), kExact);
  }
}

// At |r_xy| near pi, r_xy turns fast about the normal while the patch hardly moves.
TEST(Metrics, OfRevolutePatchesDoNotSeeTurnsAboutTheNormal)
{
  for (const PatchType type : kPatchTypes)
    if (isRevolute(type)) {
      Random random;
      Patch p = test::randomPatch(random, type);
      p.r = {0.0, M_PI - 1e-3, 0.0};
      Patch s = p;
      s.r = {1e-2, M_PI - 1e-3, 0.0};
      const double angle = std::acos(p.normal().dot(s.normal()));
      EXPECT_LT(angle, 1e-4);
      // acos keeps half the digits.
      EXPECT_NEAR(patchDistances(p, s).phi_6, angle, 1e-8);
    }
}

TEST(Metrics, AreNormsOfTheDifferences)
{
  Random random;
  const Patch p = test::randomPatch(random, kPatchTypes[0]);
  Patch s = p;
  s.c += Eigen::Vector3d(3.0, 0.0, 4.0);
  s.kappa += Eigen::Vector2d(5.0, -12.0);
  s.d.head<2>() += Eigen::Vector2d(0.8, 0.6);
  const PatchDistances distance = patchDistances(p, s);
  EXPECT_NEAR(distance.phi_t, 5.0, kExact);
  EXPECT_NEAR(distance.phi_k, 13.0, kExact);
  EXPECT_NEAR(distance.phi_d, 1.0, kExact);
}

TEST(Metrics, RejectMisuse)
{
  Random random;
  const Patch p = test::randomPatch(random, kPatchTypes[0]);
  const Patch other = test::randomPatch(random, kPatchTypes[2]);
  EXPECT_THROW(patchDistances(p, other), std::invalid_argument);
  EXPECT_THROW(metricsOf(p, {pack(p)}), std::invalid_argument);
  const ParameterMatrix covariance = ParameterMatrix::Identity(10, 10);
  EXPECT_THROW(sampleMetrics(p, covariance, random.engine(), 1), std::invalid_argument);
  EXPECT_THROW(sampleMetrics(other, covariance, random.engine()),
               std::invalid_argument);
  EXPECT_THROW(principalDeviations(other.type, covariance), std::invalid_argument);
}

TEST(Metrics, OfGivenSamplesAreTheirMeanAndVariance)
{
  Random random;
  const Patch patch = test::randomPatch(random, kPatchTypes[0]);
  std::vector<ParameterVector> samples;
  for (const double distance : {1.0, 2.0, 6.0}) {
    samples.push_back(pack(patch));
    samples.back()[9] += distance;
  }
  const MeanAndVariance phi_t = metricsOf(patch, samples).phi_t;
  EXPECT_NEAR(phi_t.mean, 3.0, kExact);
  EXPECT_NEAR(phi_t.variance, 7.0, kExact);
}

// An isotropic covariance of each group makes every distance a multiple of a chi
// variable; the rotation stays small enough that the chart is flat to 1e-6.
TEST_P(Metrics, OfIsotropicCovariancesAreThoseOfTheChiDistribution)
{
  Random random;
  Patch patch = test::randomPatch(random, GetParam());
  patch.r.setZero();
  const ParameterLayout layout = layoutOf(patch.type);
  constexpr double sigma = 1e-3;
  const ParameterMatrix covariance =
      sigma * sigma * ParameterMatrix::Identity(layout.size(), layout.size());
  constexpr int n_v = 40000;
  const PatchMetrics metrics = sampleMetrics(patch, covariance, random.engine(), n_v);
  const auto expect_chi = [&](const MeanAndVariance& metric, int n) {
    const double mean = n > 0 ? chiMean(n) : 0.0;
    const double variance = n - mean * mean;
    // Five standard errors of a mean of n_v; the variance's relative error is about
    // sqrt(2 / n_v) = 0.7 %, more for the skewed chi of n = 1.
    EXPECT_NEAR(metric.mean / sigma, mean, 5.0 * std::sqrt(variance / n_v)) << n;
    EXPECT_NEAR(metric.variance / (sigma * sigma), variance, 0.06 * variance) << n;
  };
  expect_chi(metrics.phi_t, 3);
  expect_chi(metrics.phi_k, layout.k_count);
  expect_chi(metrics.phi_d, layout.d_count);
  expect_chi(metrics.phi_6, layout.r_count);
  // The two differ by phi_6^3 / 24 only.
  EXPECT_NEAR(metrics.phi_5.mean, metrics.phi_6.mean, 1e-9);
}

TEST_P(Metrics, TakeSingularCovariances)
{
  Random random;
  const Patch patch = test::randomPatch(random, GetParam());
  const int n = degreesOfFreedom(patch.type);
  // Only the centre moves, along one line.
  ParameterMatrix covariance = ParameterMatrix::Zero(n, n);
  const Eigen::Vector3d direction = random.unitVector();
  covariance.bottomRightCorner<3, 3>() = 1e-4 * direction * direction.transpose();
  const PatchMetrics metrics = sampleMetrics(patch, covariance, random.engine(), 10000);
  // Half-normal with sigma 1e-2: standard error 0.6 % of sigma.
  EXPECT_NEAR(metrics.phi_t.mean, 1e-2 * chiMean(1), 3e-4);
  // Square roots of eigenvalues that are zero within rounding: sqrt(1e-16) * 1e-2.
  EXPECT_LT(metrics.phi_d.mean, 1e-8);
  EXPECT_LT(metrics.phi_6.mean, 1e-8);
}

TEST_P(Metrics, AreTheSameForTheSameSeed)
{
  Random random;
  const Patch patch = test::randomPatch(random, GetParam());
  const int n = degreesOfFreedom(patch.type);
  const ParameterMatrix covariance = 1e-4 * ParameterMatrix::Identity(n, n);
  std::mt19937_64 one(7), two(7);
  EXPECT_EQ(sampleMetrics(patch, covariance, one, 100).phi_6.mean,
            sampleMetrics(patch, covariance, two, 100).phi_6.mean);
}

TEST(PrincipalDeviations, NameTheParametersOfTheAxes)
{
  const PatchType type = kPatchTypes[0];
  ParameterMatrix covariance = 1e-8 * ParameterMatrix::Identity(10, 10);
  covariance(2, 2) = 4.0; // kappa_x
  // c_x and c_z move together: sigma sqrt(2 * 0.5) = 1 along their diagonal.
  covariance(7, 7) = covariance(9, 9) = 0.5;
  covariance(7, 9) = covariance(9, 7) = 0.5;
  const std::vector<PrincipalDeviation> deviations =
      principalDeviations(type, covariance);
  ASSERT_EQ(deviations.size(), 10u);
  EXPECT_NEAR(deviations[0].sigma, 2.0, kExact);
  ASSERT_EQ(deviations[0].components.size(), 1u);
  EXPECT_EQ(deviations[0].components[0].name, "kappa_x");
  EXPECT_NEAR(deviations[0].components[0].weight, 1.0, kExact);
  EXPECT_NEAR(deviations[1].sigma, 1.0, kExact);
  ASSERT_EQ(deviations[1].components.size(), 2u);
  const std::string first = deviations[1].components[0].name;
  const std::string second = deviations[1].components[1].name;
  EXPECT_TRUE((first == "c_x" && second == "c_z") ||
              (first == "c_z" && second == "c_x"));
  EXPECT_NEAR(deviations[1].components[1].weight, std::sqrt(0.5), kExact);
  for (std::size_t i = 1; i < deviations.size(); ++i)
    EXPECT_LE(deviations[i].sigma, deviations[i - 1].sigma);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Metrics,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
