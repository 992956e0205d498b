// The covariance against central differences of the whole pipeline: every coordinate of
// every point is moved and the patch fitted again, from scatter to bounds.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include <holdfast/patch_estimator.h>

namespace holdfast { namespace {

using test::Random;
using test::Sample;

class CovarianceExact : public testing::TestWithParam<PatchType> {};

// The requirement on the normalised difference. Differencing itself is right to some
// 1e-8: truncation is of second order in a step of 3e-4 sigma, and the refits converge
// to 1e-10 sigma.
constexpr double kTolerance = 1e-6;
constexpr double kStepSigma = 3e-4;

// Parameters, then the coordinates of the state about a reference.
using Coordinates = Eigen::VectorXd;

// Parameters and state of a patch fitted to the sample, with the batch's origin held
// fixed so that coordinates round alike.
Coordinates
refit(const PatchEstimator& estimator,
      const Sample& sample,
      const PatchState& reference,
      PointBatch& batch)
{
  const Eigen::Vector3d origin = batch.origin();
  batch.clear(origin, sample.viewpoint);
  for (std::size_t i = 0; i < sample.points.size(); ++i)
    batch.add(sample.points[i], sample.covariances[i]);
  const FitResult fit = estimator.estimate(batch);
  const ParameterVector parameters = pack(fit.patch);
  const StateVector state = difference(fit.state, reference);
  Coordinates both(parameters.size() + state.size());
  both << parameters, state;
  return both;
}

// As many digits as there are.
constexpr double kTight = 1e-10;

// sum_i G_i Sigma_i G_i^T with G_i by central differences.
Eigen::MatrixXd
differencedCovariance(const Sample& sample, FitOptions options)
{
  options.polish_tolerance_sigma = kTight;
  const PatchEstimator estimator(options);
  Sample moved = sample;
  PointBatch batch = test::batchOf(sample);
  const PatchState reference = estimator.estimate(batch).state;
  const Eigen::Index n = refit(estimator, sample, reference, batch).size();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < sample.points.size(); ++i) {
    const Eigen::Matrix3d& S = sample.covariances[i];
    const double step = kStepSigma * std::sqrt(S.trace());
    Eigen::MatrixXd G(n, 3);
    for (int k = 0; k < 3; ++k) {
      moved.points[i][k] = sample.points[i][k] + step;
      const Coordinates ahead = refit(estimator, moved, reference, batch);
      moved.points[i][k] = sample.points[i][k] - step;
      G.col(k) = (ahead - refit(estimator, moved, reference, batch)) / (2.0 * step);
      moved.points[i][k] = sample.points[i][k];
    }
    covariance += G * S * G.transpose();
  }
  return covariance;
}

FitResult
fitted(const Sample& sample,
       const FitOptions& options,
       CovarianceMode mode = CovarianceMode::Exact)
{
  PointBatch batch = test::batchOf(sample);
  return estimatePatch(batch, options, mode);
}

void
expectExact(const Sample& sample, FitOptions options)
{
  options.polish_tolerance_sigma = kTight;
  const FitResult result = fitted(sample, options);
  ASSERT_TRUE(isUsable(result.status)) << statusName(result.status);
  const Eigen::MatrixXd differenced = differencedCovariance(sample, options);
  const Eigen::Index n = result.covariance.rows(), m = result.state_covariance.rows();
  EXPECT_LT(
      test::normalizedDifference(result.covariance, differenced.topLeftCorner(n, n)),
      kTolerance)
      << sample.points.size() << " points";
  EXPECT_LT(test::normalizedDifference(result.state_covariance,
                                       differenced.bottomRightCorner(m, m)),
            kTolerance)
      << sample.points.size() << " points, chi2/dof " << result.chi2 / result.chi2_dof;
}

struct Variant {
  const char* name;
  FitOptions options;
};

std::vector<Variant>
variants()
{
  FitOptions ray, paper_ray = FitOptions::paper();
  ray.residual = paper_ray.residual = Residual::Ray;
  return {{"defaults", FitOptions{}},
          {"ray residual", ray},
          {"paper", FitOptions::paper()},
          {"paper with ray residual", paper_ray}};
}

TEST_P(CovarianceExact, EqualsDifferencesOnNoisyData)
{
  for (const Variant& variant : variants()) {
    SCOPED_TRACE(variant.name);
    Random random;
    const Sample sample = transformed(test::robotSample(GetParam(), 1.0, random),
                                      test::randomPose(random));
    expectExact(sample, test::optionsFor(GetParam(), variant.options));
  }
}

TEST_P(CovarianceExact, EqualsDifferencesWhereTheModelMisfits)
{
  for (const Variant& variant : variants()) {
    SCOPED_TRACE(variant.name);
    Random random;
    Sample sample = test::robotSample(GetParam(), 1.0, random);
    // Twice the sensor's noise, 12 cm from crest to crest.
    test::addBumps(sample, 8e-3, 8.0);
    sample = transformed(sample, test::randomPose(random));
    expectExact(sample, test::optionsFor(GetParam(), variant.options));
  }
}

TEST_P(CovarianceExact, EqualsDifferencesOnTheTableTwoScenes)
{
  Random random;
  const Sample sample =
      test::sampleScene(tableTwoScene(GetParam()), 1.0, random.engine());
  expectExact(sample, test::optionsFor(GetParam()));
}

// The type is decided by the data here, the same way for every refit.
TEST(CovarianceOfDecidedType, EqualsDifferences)
{
  for (const PatchType type : {kPatchTypes[0], kPatchTypes[1], kPatchTypes[2]}) {
    SCOPED_TRACE(test::typeName(type));
    Random random;
    const Sample sample =
        test::sampleScene(robotScene(type, 0.8, 0.5, 0.6), 0.5, random.engine());
    expectExact(sample, FitOptions{});
  }
}

// Hessian and J^T J differ by terms of first order in the residuals, whose size is
// sqrt(chi2/dof). That does not vanish with the noise where points are sampled
// unevenly: the line on which a paraboloid's centre lies then misses its apex.
TEST_P(CovarianceExact, GaussNewtonDiffersByTheSizeOfTheResiduals)
{
  for (const double noise_scale : {1e-2, 1e-4}) {
    Random random;
    const Sample sample = test::robotSample(GetParam(), noise_scale, random);
    FitOptions options = test::optionsFor(GetParam());
    const FitResult exact = fitted(sample, options);
    const FitResult gauss_newton = fitted(sample, options, CovarianceMode::GaussNewton);
    ASSERT_TRUE(isUsable(exact.status)) << statusName(exact.status);
    EXPECT_LT(test::normalizedDifference(gauss_newton.covariance, exact.covariance),
              0.5 * std::sqrt(exact.chi2 / exact.chi2_dof));
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         CovarianceExact,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

// Patches from well to barely told, as noise grows thirtyfold.
TEST(CovarianceAuto, IsSecondOrderWhereOnlyThatTellsTheParameters)
{
  Random random;
  int exact_ones = 0, second_ones = 0;
  for (int i = 0; i < 60; ++i) {
    const PatchType type =
        kPatchTypes[static_cast<std::size_t>(i) % kPatchTypes.size()];
    const Sample sample =
        test::robotSample(type, std::exp(random.uniform(-1.0, 3.5)), random);
    const FitOptions options = test::optionsFor(type, FitOptions{});
    const FitResult exact = fitted(sample, options);
    const FitResult second = fitted(sample, options, CovarianceMode::SecondOrder);
    const FitResult automatic = fitted(sample, options, CovarianceMode::Auto);
    if (!isUsable(exact.status))
      continue;
    const auto axis_lost = [](const FitResult& fit) {
      return fit.flags.axis_not_observable || fit.flags.curvature_not_observable;
    };
    const bool is_second = automatic.mean_shift->size() > 0;
    EXPECT_EQ(automatic.covariance, is_second ? second.covariance : exact.covariance);
    EXPECT_EQ(automatic.state_covariance,
              is_second ? second.state_covariance : exact.state_covariance);
    if (!axis_lost(exact)) {
      EXPECT_FALSE(is_second);
      ++exact_ones;
    }
    else if (is_second) {
      ++second_ones;
    }
    else {
      EXPECT_TRUE(axis_lost(automatic));
    }
  }
  EXPECT_GT(exact_ones, 0);
  EXPECT_GT(second_ones, 0);
}

}} // namespace holdfast
