// What the options' defaults leave of the digits, at full noise: beside fits with as
// many as there are.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include <holdfast/patch_estimator.h>

namespace holdfast { namespace {

using test::Random;
using test::Sample;

// A millionth of a sigma, and a ten-thousandth of the covariance: nobody can measure
// them.
constexpr double kParameterSigmas = 1e-6, kCovariance = 1e-4;

constexpr std::uint64_t kCases = 40;

FitResult
fitted(const Sample& sample, FitOptions options, double tolerance_sigma)
{
  options.polish_tolerance_sigma = tolerance_sigma;
  PointBatch batch = test::batchOf(sample);
  return estimatePatch(batch, options);
}

class FitPrecision : public testing::TestWithParam<PatchType> {};

TEST_P(FitPrecision, OfTheDefaultsIsBeyondMeasure)
{
  const FitOptions options = test::optionsFor(GetParam());
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Sample sample = transformed(test::robotSample(GetParam(), 1.0, random),
                                      test::randomPose(random));
    const FitResult usual = fitted(sample, options, options.polish_tolerance_sigma);
    const FitResult tight = fitted(sample, options, 1e-10);
    ASSERT_EQ(usual.status, tight.status);
    if (!isUsable(tight.status))
      continue;
    const StateVector step = difference(usual.state, tight.state);
    const Eigen::VectorXd sigmas =
        tight.state_covariance.diagonal().cwiseSqrt().cwiseInverse();
    EXPECT_LT(step.cwiseProduct(sigmas).lpNorm<Eigen::Infinity>(), kParameterSigmas);
    EXPECT_LT(
        test::normalizedDifference(usual.state_covariance, tight.state_covariance),
        kCovariance);
    EXPECT_LT(test::normalizedDifference(usual.covariance, tight.covariance),
              kCovariance);
    EXPECT_NEAR(usual.chi2, tight.chi2, 1e-9 * tight.chi2);
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         FitPrecision,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
