// Resampled fits: their spread on a problem whose covariance is known, the same result
// for any number of threads, and the representations that make them comparable.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include "fit/fit_patch.h"
#include "parallel/parallel_for.h"

#include <holdfast/evaluation/metrics.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace holdfast { namespace {

using test::Random;

// A flat grid in the xy plane, seen from above; noise of sigma along z only.
PointBatch
flatGrid(int n, double spacing, double sigma)
{
  const Eigen::Matrix3d S = Eigen::Vector3d(0.0, 0.0, sigma * sigma).asDiagonal();
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      batch.add({spacing * (i - 0.5 * (n - 1)), spacing * (j - 0.5 * (n - 1)), 0.0}, S);
  return batch;
}

FitOptions
planeOptions()
{
  FitOptions options;
  options.surface = SurfaceRequest::Plane;
  options.plane_boundary = BoundaryType::Circle;
  return options;
}

Patch
fitted(PointBatch& batch, const FitOptions& options)
{
  const PatchFit fit = PatchFitter(options).fit(batch);
  EXPECT_EQ(fit.status, FitStatus::Converged);
  return fit.bounded.patch;
}

// The centre of a plane through N points with noise along its normal is their mean:
// var c_z = sigma^2 / N; the slopes have var = sigma^2 / sum x^2.
TEST(MonteCarlo, GivesTheCovarianceOfALinearFit)
{
  constexpr int n = 9;
  constexpr double spacing = 0.01, sigma = 1e-4;
  PointBatch batch = flatGrid(n, spacing, sigma);
  const FitOptions options = planeOptions();
  const Patch reference = fitted(batch, options);
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 20000;
  const MonteCarloResult result =
      monteCarloCovariance(reference, batch, options, monte_carlo);
  EXPECT_EQ(result.failures, 0);
  ASSERT_EQ(result.samples.size(), 20000u);
  const ParameterLayout layout = layoutOf(reference.type);
  const int c_z = layout.c() + 2, r_x = layout.r(), r_y = layout.r() + 1;
  const double sum_xx = n * spacing * spacing * n * (n * n - 1) / 12.0;
  // Relative standard error of a variance: sqrt(2 / trials) = 1 %; five of them.
  constexpr double tolerance = 0.05;
  const auto& S = result.covariance;
  EXPECT_NEAR(S(c_z, c_z) / (sigma * sigma / (n * n)), 1.0, tolerance);
  EXPECT_NEAR(S(r_x, r_x) / (sigma * sigma / sum_xx), 1.0, tolerance);
  EXPECT_NEAR(S(r_y, r_y) / (sigma * sigma / sum_xx), 1.0, tolerance);
  // Correlations are 0.7 % at random.
  EXPECT_NEAR(S(c_z, r_x) / std::sqrt(S(c_z, c_z) * S(r_x, r_x)), 0.0, tolerance);
  // The mean: five standard errors.
  EXPECT_NEAR(result.mean[c_z], 0.0, 5.0 * sigma / n / std::sqrt(20000.0));
}

class MonteCarloOfType : public testing::TestWithParam<PatchType> {};

TEST_P(MonteCarloOfType, DoesNotDependOnTheNumberOfThreads)
{
  Random random;
  const test::Sample sample = test::robotSample(GetParam(), 1.0, random);
  FitOptions options = withType(FitOptions{}, GetParam());
  PointBatch batch = test::batchOf(sample);
  const Patch reference = fitted(batch, options);
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 50;
  monte_carlo.seed = random.seed();
  monte_carlo.threads = 1;
  const MonteCarloResult one =
      monteCarloCovariance(reference, batch, options, monte_carlo);
  for (const int threads : {2, 7}) {
    monte_carlo.threads = threads;
    const MonteCarloResult more =
        monteCarloCovariance(reference, batch, options, monte_carlo);
    EXPECT_EQ(more.samples, one.samples);
    EXPECT_EQ(more.covariance, one.covariance);
    EXPECT_EQ(more.failures, one.failures);
  }
}

// With a tenth of the noise the estimate is nearly linear, and the exact covariance is
// the truth.
TEST_P(MonteCarloOfType, AgreesWithTheExactCovarianceForLittleNoise)
{
  Random random;
  test::Sample sample =
      test::sampleScene(robotScene(GetParam(), 0.8, 0.5, 0.6), 0.0, random.engine());
  for (Eigen::Matrix3d& covariance : sample.covariances)
    covariance *= 0.01;
  FitOptions options = withType(FitOptions{}, GetParam());
  PointBatch batch = test::batchOf(sample);
  const FitResult fit = estimatePatch(batch, options);
  ASSERT_EQ(fit.status, FitStatus::Converged);
  const ParameterMatrix& exact = fit.covariance;
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 4000;
  monte_carlo.seed = random.seed();
  const MonteCarloResult result =
      monteCarloCovariance(fit.patch, batch, options, monte_carlo);
  EXPECT_EQ(result.failures, 0);
  // Standard error of a sigma: 1 / sqrt(2 trials) = 1.1 %; five of them over some ten
  // parameters, rounded up.
  for (int i = 0; i < exact.rows(); ++i)
    EXPECT_NEAR(std::sqrt(exact(i, i) / result.covariance(i, i)), 1.0, 0.06)
        << parameterNames(GetParam())[static_cast<std::size_t>(i)];
}

// Fits of patches whose canonical form is at an edge (x axis along world y, |r| = pi,
// equal bounds) fall on both sides of it; the spread must not see that.
TEST_P(MonteCarloOfType, SpreadIsFreeOfJumpsBetweenRepresentations)
{
  Random random;
  test::Sample sample =
      test::sampleScene(robotScene(GetParam(), 0.8, 0.3, 0.6), 0.0, random.engine());
  for (Eigen::Matrix3d& covariance : sample.covariances)
    covariance *= 0.01;
  // Revolute patches have no covariance of r_xy at its edge: only turned about z.
  const double tilt = isRevolute(GetParam()) ? 0.0 : M_PI - 1e-3;
  Pose turn;
  turn.R = expMap(Eigen::Vector3d(0.0, 0.0, 0.5 * M_PI)) *
           expMap(Eigen::Vector3d(tilt, 0.0, 0.0));
  sample = test::transformed(sample, turn);
  FitOptions options = withType(FitOptions{}, GetParam());
  PointBatch batch = test::batchOf(sample);
  const Patch reference = fitted(batch, options);
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 200;
  monte_carlo.seed = random.seed();
  const MonteCarloResult result =
      monteCarloCovariance(reference, batch, options, monte_carlo);
  ASSERT_EQ(result.failures, 0);
  const int r = layoutOf(GetParam()).r();
  // A jump would show as a sigma of order one; the noise makes some hundredths.
  EXPECT_LT(result.covariance.diagonal()
                .segment(r, rotationParameterCount(GetParam()))
                .cwiseSqrt()
                .maxCoeff(),
            0.3);
}

TEST_P(MonteCarloOfType, NearestRepresentationIsTheSamePatch)
{
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(i);
    const Patch patch = test::randomPatch(random, GetParam());
    const Patch reference = test::randomPatch(random, GetParam());
    const Patch nearest = nearestRepresentation(patch, reference);
    EXPECT_LE((nearest.r - reference.r).norm(),
              (patch.r - reference.r).norm() + 2.0 * M_PI);
    EXPECT_LT((nearest.normal() - patch.normal()).norm(), 1e-12);
    // A point is inside one if it is inside the other.
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d local(random.uniform(-0.2, 0.2),
                                  random.uniform(-0.2, 0.2),
                                  0.0);
      const Eigen::Vector3d world = patch.pose().toWorld(local);
      EXPECT_EQ(contains(patch, local.head<2>()),
                contains(nearest, nearest.pose().toLocal(world).head<2>()));
    }
  }
}

TEST(MonteCarlo, CountsFailures)
{
  // Three points determine a plane only without noise worth the name; with noise of the
  // size of their distances some fits fail or tilt, but every trial is accounted for.
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d S = 1e-4 * Eigen::Matrix3d::Identity();
  for (const auto& xy : {std::pair(0.0, 0.0), {0.01, 0.0}, {0.0, 0.01}})
    batch.add({xy.first, xy.second, 0.0}, S);
  const FitOptions options = planeOptions();
  Patch reference;
  reference.type = {SurfaceType::Plane, BoundaryType::Circle};
  reference.d[0] = 0.01;
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 100;
  const MonteCarloResult result =
      monteCarloCovariance(reference, batch, options, monte_carlo);
  EXPECT_EQ(result.samples.size() + static_cast<std::size_t>(result.failures), 100u);
  EXPECT_GT(result.failures, 0);
}

TEST(MonteCarlo, RejectsMisuse)
{
  PointBatch batch = flatGrid(5, 0.01, 1e-3);
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 0;
  EXPECT_THROW(monteCarloCovariance(Patch{}, batch, planeOptions(), monte_carlo),
               std::invalid_argument);
}

TEST(ForEachIndex, CallsEachOnce)
{
  for (const int threads : {0, 1, 3, 50}) {
    std::vector<std::atomic<int>> calls(40);
    int reports = 0;
    parallelFor(
        40,
        threads,
        [&calls](int i, int) { ++calls[static_cast<std::size_t>(i)]; },
        [&reports](int, int total) {
          ++reports;
          EXPECT_EQ(total, 40);
        });
    for (const auto& count : calls)
      EXPECT_EQ(count, 1);
    EXPECT_EQ(reports, 40);
  }
}

TEST(ForEachIndex, PassesOnExceptions)
{
  for (const int threads : {1, 4})
    EXPECT_THROW(parallelFor(100,
                             threads,
                             [](int i, int) {
                               if (i == 10)
                                 throw std::runtime_error("ten");
                             }),
                 std::runtime_error);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         MonteCarloOfType,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
