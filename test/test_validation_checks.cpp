// Verdicts on fitted patches.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include <holdfast/patch/boundary.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/validation/checks.h>

#include <limits>
#include <set>

namespace holdfast { namespace {

using test::Random;
using test::Sample;

constexpr std::uint64_t kCases = 20;

const ValidationOptions kNone = ValidationOptions::withoutLimits();

// Limits that sound fits of the robot scenes keep with a wide margin: curvatures are at
// most 10 1/m, the noise 2 to 5 mm.
ValidationOptions
fairLimits()
{
  ValidationOptions options = kNone;
  options.max_curvature_per_m = 20.0;
  options.max_residual_m = 0.01;
  options.min_coverage = 0.4;
  options.max_chi2_per_dof = 1.5;
  return options;
}

struct Fit {
  FitResult result;
  PointBatch batch;
};

Fit
fitTo(const Sample& sample, PatchType type)
{
  Fit fit;
  fit.batch = test::batchOf(sample);
  FitOptions options = test::optionsFor(type);
  fit.result = estimatePatch(fit.batch, options);
  return fit;
}

class Checks : public testing::TestWithParam<PatchType> {};

TEST_P(Checks, AcceptASoundFitAndReportWhatTheyMeasured)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Sample sample = test::robotSample(GetParam(), 1.0, random);
    const Fit fit = fitTo(sample, GetParam());
    const Validation validation = validate(fit.result, fit.batch, fairLimits());
    EXPECT_EQ(verdictName(validation.verdict), "accepted");
    const SurfaceResidual residual = measureResidual(fit.result.patch, fit.batch);
    const Coverage coverage = measureCoverage(fit.result.patch, fit.batch);
    EXPECT_EQ(validation.residual.rms_m, residual.rms_m);
    EXPECT_EQ(validation.coverage.share, coverage.share);
    EXPECT_EQ(validation.chi2_per_dof, fit.result.chi2 / fit.result.chi2_dof);
    EXPECT_EQ(validation.curvature_per_m,
              fit.result.patch.kappa.lpNorm<Eigen::Infinity>());
    EXPECT_EQ(validate(fit.result, sample.points, fairLimits()).verdict,
              PatchVerdict::Accepted);
  }
}

TEST_P(Checks, RejectByEveryLimitJustBelowTheMeasuredValue)
{
  Random random;
  const Fit fit = fitTo(test::robotSample(GetParam(), 1.0, random), GetParam());
  ASSERT_TRUE(isUsable(fit.result.status));
  const Validation measured = validate(fit.result, fit.batch, kNone);
  EXPECT_EQ(measured.verdict, PatchVerdict::Accepted) << "without limits";
  const auto verdict = [&](std::optional<double> ValidationOptions::*limit,
                           double value) {
    ValidationOptions options = kNone;
    options.*limit = value;
    return validate(fit.result, fit.batch, options).verdict;
  };
  const auto expectLimit = [&](std::optional<double> ValidationOptions::*limit,
                               double value,
                               PatchVerdict rejected) {
    EXPECT_EQ(verdict(limit, value), PatchVerdict::Accepted);
    EXPECT_EQ(verdict(limit, 0.999 * value), rejected);
  };
  expectLimit(&ValidationOptions::max_residual_m,
              measured.residual.rms_m,
              PatchVerdict::ResidualTooLarge);
  expectLimit(&ValidationOptions::max_chi2_per_dof,
              measured.chi2_per_dof,
              PatchVerdict::ChiSquareTooLarge);
  if (measured.curvature_per_m > 0.0)
    expectLimit(&ValidationOptions::max_curvature_per_m,
                measured.curvature_per_m,
                PatchVerdict::CurvatureTooLarge);
  EXPECT_EQ(verdict(&ValidationOptions::min_coverage, measured.coverage.share),
            PatchVerdict::Accepted);
}

TEST_P(Checks, RejectAPatchWhosePointsLeaveMostOfItEmpty)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Sample sample = test::robotSample(GetParam(), 1.0, random);
    const Fit fit = fitTo(sample, GetParam());
    // Cells that do not grow as the points get fewer.
    ValidationOptions options = kNone;
    options.coverage.cell_size_m = 0.03;
    options.coverage.points_per_cell =
        fit.batch.size() * 0.03 * 0.03 / projectedArea(fit.result.patch);
    options.min_coverage =
        0.8 * validate(fit.result, fit.batch, options).coverage.share;
    const Pose pose = fit.result.patch.pose();
    std::vector<Eigen::Vector3d> few;
    for (const Eigen::Vector3d& point : sample.points)
      if (pose.toLocal(point).x() > 0.25 * fit.result.patch.d(0))
        few.push_back(point);
    EXPECT_EQ(validate(fit.result, few, options).verdict, PatchVerdict::CoverageTooLow);
  }
}

TEST_P(Checks, RejectASurfaceThatTheNoiseDoesNotExplain)
{
  Random random;
  Sample sample = test::robotSample(GetParam(), 0.1, random);
  test::addBumps(sample, 0.02, 20.0);
  const Fit fit = fitTo(sample, GetParam());
  ASSERT_TRUE(isUsable(fit.result.status)) << statusName(fit.result.status);
  ValidationOptions options = kNone;
  options.max_chi2_per_dof = 1.5;
  EXPECT_EQ(validate(fit.result, fit.batch, options).verdict,
            PatchVerdict::ChiSquareTooLarge);
}

// No point of the surface within the bounds is higher over the tangent plane.
TEST_P(Checks, MeasureASagittaThatHoldsAllHeights)
{
  Random random;
  const Fit fit = fitTo(test::robotSample(GetParam(), 0.3, random), GetParam());
  ASSERT_TRUE(isUsable(fit.result.status));
  const Patch& patch = fit.result.patch;
  const double sagitta = validate(fit.result, fit.batch, kNone).sagitta_m;
  const Eigen::Vector2d k = patch.principalCurvatures();
  EXPECT_EQ(k.isZero(0.0), sagitta == 0.0);
  for (int i = 0; i < 100; ++i) {
    const double angle = random.uniform(0.0, 6.28);
    const double dy = isRevolute(patch.type) ? patch.d[0] : patch.d[1];
    const double x = patch.d[0] * std::cos(angle), y = dy * std::sin(angle);
    EXPECT_LE(std::abs(0.5 * (k.x() * x * x + k.y() * y * y)), sagitta * (1.0 + 1e-12));
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Checks,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

TEST(Verdicts, OfAFitThatIsNotUsableMeasureNothing)
{
  PointBatch batch;
  const FitResult failed = estimatePatch(batch, {});
  const Validation validation = validate(failed, batch, fairLimits());
  EXPECT_EQ(validation.verdict, PatchVerdict::NotUsable);
  EXPECT_EQ(validation.residual.points, 0);
  EXPECT_EQ(validation.coverage.cells, 0);
}

TEST(Verdicts, WithoutAFinitePointAreNotUsable)
{
  Random random;
  const PatchType type = kPatchTypes.front();
  const Fit fit = fitTo(test::robotSample(type, 1.0, random), type);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector3d> none, invalid(3, {0.0, nan, 0.0});
  EXPECT_EQ(validate(fit.result, none, kNone).verdict, PatchVerdict::NotUsable);
  EXPECT_EQ(validate(fit.result, invalid, kNone).verdict, PatchVerdict::NotUsable);
  EXPECT_EQ(validate(fit.result, PointBatch(), kNone).verdict, PatchVerdict::NotUsable);
}

TEST(Verdicts, NameTheFirstLimitThatIsBroken)
{
  Random random;
  const PatchType type = kPatchTypes.front();
  const Fit fit = fitTo(test::robotSample(type, 1.0, random), type);
  ValidationOptions options = kNone;
  const auto verdict = [&] { return validate(fit.result, fit.batch, options).verdict; };
  options.max_chi2_per_dof = 1e-3;
  EXPECT_EQ(verdict(), PatchVerdict::ChiSquareTooLarge);
  options.coverage.cell_size_m = 0.02;
  options.coverage.points_per_cell = 1e6;
  options.min_coverage = 0.5;
  EXPECT_EQ(verdict(), PatchVerdict::CoverageTooLow);
  options.max_residual_m = 1e-6;
  EXPECT_EQ(verdict(), PatchVerdict::ResidualTooLarge);
  options.max_curvature_per_m = 1e-3;
  EXPECT_EQ(verdict(), PatchVerdict::CurvatureTooLarge);
}

TEST(Verdicts, OnPointsBeyondAllReasonAreNotAccepted)
{
  Random random;
  const PatchType type = kPatchTypes.front();
  const Fit fit = fitTo(test::robotSample(type, 1.0, random), type);
  const std::vector<Eigen::Vector3d> far(10, Eigen::Vector3d::Constant(1e200));
  ValidationOptions options = kNone;
  options.max_residual_m = 0.01;
  EXPECT_EQ(validate(fit.result, far, options).verdict, PatchVerdict::ResidualTooLarge);
  EXPECT_EQ(validate(fit.result, far, kNone).coverage.share, 0.0);
}

TEST(Verdicts, HaveNamesOfTheirOwn)
{
  std::set<std::string_view> names;
  for (int i = 0; i <= static_cast<int>(PatchVerdict::OverEdge); ++i)
    names.insert(verdictName(static_cast<PatchVerdict>(i)));
  EXPECT_EQ(names.size(), 11u);
  EXPECT_EQ(verdictName(PatchVerdict::Accepted), "accepted");
  EXPECT_EQ(verdictName(PatchVerdict::ChiSquareTooLarge), "chi_square_too_large");
}

// In radii of the neighbourhood; without one they are not asked.
TEST(Verdicts, OnWhatIsMeasuredInRadii)
{
  Random random;
  const PatchType type{SurfaceType::EllipticParaboloid, BoundaryType::Ellipse};
  Fit fit = fitTo(test::robotSample(type, 1.0, random), type);
  fit.batch.channel(PointBatch::Z)[0] += 0.05; // an obstacle: a dozen sigmas
  constexpr double kRadius = 0.1;
  const Validation measured = validate(fit.result, fit.batch, kNone, kRadius);
  EXPECT_EQ(measured.verdict, PatchVerdict::Accepted);
  const auto expectLimit = [&](std::optional<double> ValidationOptions::*limit,
                               double value,
                               PatchVerdict rejected) {
    ValidationOptions options = kNone;
    options.*limit = 1.001 * value;
    EXPECT_EQ(validate(fit.result, fit.batch, options, kRadius).verdict,
              PatchVerdict::Accepted);
    options.*limit = 0.999 * value;
    EXPECT_EQ(validate(fit.result, fit.batch, options, kRadius).verdict, rejected);
    EXPECT_EQ(validate(fit.result, fit.batch, options).verdict,
              limit == &ValidationOptions::max_view_angle_rad ? rejected :
                                                                PatchVerdict::Accepted);
  };
  expectLimit(&ValidationOptions::max_extent,
              measured.extent_m / kRadius,
              PatchVerdict::ExtentTooLarge);
  expectLimit(&ValidationOptions::max_sagitta,
              measured.sagitta_m / kRadius,
              PatchVerdict::SagittaTooLarge);
  expectLimit(&ValidationOptions::max_bend,
              measured.curvature_per_m * kRadius,
              PatchVerdict::CurvatureTooLarge);
  expectLimit(&ValidationOptions::max_departure,
              measured.residual.unexplained_m / kRadius,
              PatchVerdict::DepartureTooLarge);
  expectLimit(&ValidationOptions::max_noise,
              measured.noise_m / kRadius,
              PatchVerdict::NoiseTooLarge);
  ValidationOptions options = kNone;
  options.max_view_angle_rad = 1.5;
  EXPECT_FALSE(measured.view_angle_rad);
  const double angle = validate(fit.result, fit.batch, options).view_angle_rad.value();
  const Eigen::Vector3d ray = fit.batch.viewpoint() - fit.result.patch.c;
  EXPECT_NEAR(std::cos(angle), fit.result.patch.normal().dot(ray.normalized()), 1e-12);
  expectLimit(&ValidationOptions::max_view_angle_rad,
              angle,
              PatchVerdict::NormalNotSeen);
}

// Noise that reaches beyond the limit of a departure is none, an obstacle is; and there
// is noise that no patch of that radius stands.
TEST(Verdicts, OnDeparturesAreAboutWhatNoiseDoesNotExplain)
{
  Random random;
  constexpr double kRadius = 0.05;
  const auto verdict = [&](double sigma, double obstacle) {
    PointBatch batch;
    batch.clear({0.0, 0.0, 2.5});
    const Eigen::Vector3d variance(1e-8, 1e-8, sigma * sigma);
    for (int i = 0; i < 400; ++i) {
      const double angle = random.uniform(0.0, 6.283);
      const double r = kRadius * std::sqrt(random.uniform(0.0, 1.0));
      // Within what 400 points reach by chance.
      const double noise = std::clamp(random.normal(), -3.5, 3.5) * sigma;
      batch.add({r * std::cos(angle), r * std::sin(angle), 2.5 + noise},
                variance.asDiagonal());
    }
    batch.add({0.0, 0.0, 2.5 - obstacle}, variance.asDiagonal());
    FitOptions options;
    options.surface = SurfaceRequest::Plane;
    const FitResult fit = estimatePatch(batch, options);
    EXPECT_TRUE(isUsable(fit.status));
    return validate(fit, batch, ValidationOptions(), kRadius).verdict;
  };
  for (const double sigma : {0.002, 0.01, 0.03}) {
    EXPECT_EQ(verdict(sigma, 0.0), PatchVerdict::Accepted) << sigma;
    EXPECT_EQ(verdict(sigma, 0.3 * kRadius), PatchVerdict::Accepted) << sigma;
    EXPECT_EQ(verdict(sigma, 0.36 * kRadius + 4.5 * sigma),
              PatchVerdict::DepartureTooLarge)
        << sigma;
  }
  EXPECT_EQ(verdict(0.04, 0.0), PatchVerdict::NoiseTooLarge);
}

TEST(ValidationOptionsCheck, NamesWhatIsWrong)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(validityError(ValidationOptions{}), "");
  EXPECT_EQ(validityError(fairLimits()), "");
  const auto expectError = [](std::optional<double> ValidationOptions::*limit,
                              double value,
                              const char* name) {
    ValidationOptions options = kNone;
    options.*limit = value;
    EXPECT_NE(validityError(options).find(name), std::string::npos) << value;
    EXPECT_THROW(validate(FitResult(), PointBatch(), options), std::invalid_argument);
  };
  for (const double bad : {0.0, -1.0, nan}) {
    expectError(&ValidationOptions::max_curvature_per_m, bad, "max_curvature_per_m");
    expectError(&ValidationOptions::max_residual_m, bad, "max_residual_m");
    expectError(&ValidationOptions::max_chi2_per_dof, bad, "max_chi2_per_dof");
    expectError(&ValidationOptions::max_extent, bad, "max_extent");
    expectError(&ValidationOptions::max_sagitta, bad, "max_sagitta");
    expectError(&ValidationOptions::max_bend, bad, "max_bend");
    expectError(&ValidationOptions::max_departure, bad, "max_departure");
    expectError(&ValidationOptions::max_noise, bad, "max_noise");
    expectError(&ValidationOptions::max_stray, bad, "max_stray");
    expectError(&ValidationOptions::max_view_angle_rad, bad, "max_view_angle_rad");
  }
  for (const double bad : {-0.1, 1.1, nan})
    expectError(&ValidationOptions::min_coverage, bad, "min_coverage");
  ValidationOptions options = kNone;
  options.coverage.max_spill = -1.0;
  EXPECT_NE(validityError(options).find("max_spill"), std::string::npos);
}

}} // namespace holdfast
