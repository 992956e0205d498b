// Stage I-3: the type of a paraboloid from its curvatures and their covariance.
#include "support/patch_batch.h"

#include "fit/discrimination.h"
#include "fit/fit_patch.h"

#include <cmath>

namespace holdfast { namespace {

using test::Random;

constexpr double kLevel = 0.01;

// (kxx, kxy, kyy) of principal curvatures whose first axis is at `angle` from x.
Eigen::Vector3d
curvatures(double k1, double k2, double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  return {k1 * c * c + k2 * s * s, (k1 - k2) * c * s, k1 * s * s + k2 * c * c};
}

// A covariance of the sigma given, no two entries alike.
Eigen::Matrix3d
covarianceOf(double sigma)
{
  Eigen::Matrix3d C;
  C << 1.0, 0.1, -0.3, 0.1, 0.4, 0.05, -0.3, 0.05, 1.3;
  return sigma * sigma * C;
}

SurfaceType
decided(const Eigen::Vector3d& k, double sigma, const FitOptions& options = {})
{
  return discriminate(k,
                      covarianceOf(sigma),
                      DiscriminationThresholds::atLevel(kLevel),
                      options);
}

TEST(Discrimination, ThresholdsAreThoseOfTheChiSquareTable)
{
  const DiscriminationThresholds at1 = DiscriminationThresholds::atLevel(0.01);
  EXPECT_NEAR(at1.plane, 11.345, 5e-4);
  EXPECT_NEAR(at1.circular, 9.210, 5e-4);
  EXPECT_NEAR(at1.cylindric, 6.635, 5e-4);
  const DiscriminationThresholds at5 = DiscriminationThresholds::atLevel(0.05);
  EXPECT_NEAR(at5.plane, 7.815, 5e-4);
  EXPECT_NEAR(at5.circular, 5.991, 5e-4);
  EXPECT_NEAR(at5.cylindric, 3.841, 5e-4);
}

TEST(Discrimination, ClearCurvaturesGiveTheirTypeInAnyDirection)
{
  for (std::uint64_t i = 0; i < 100; ++i) {
    Random random(i);
    const double angle = random.uniform(-3.2, 3.2), sign = random.sign();
    const auto type = [&](double k1, double k2) {
      return decided(curvatures(sign * k1, sign * k2, angle), 0.3);
    };
    EXPECT_EQ(type(0.1, -0.2), SurfaceType::Plane);
    EXPECT_EQ(type(8.0, 7.9), SurfaceType::CircularParaboloid);
    EXPECT_EQ(type(8.0, 0.2), SurfaceType::CylindricParaboloid);
    EXPECT_EQ(type(8.0, 4.0), SurfaceType::EllipticParaboloid);
    EXPECT_EQ(type(8.0, -4.0), SurfaceType::HyperbolicParaboloid);
  }
}

TEST(Discrimination, EveryTestTurnsAtItsThreshold)
{
  // With an isotropic covariance in the metric of the curvature matrix the statistics
  // are elementary: k^T C^-1 k = (k1^2 + k2^2)/s^2, (k1 - k2)^2/(2 s^2), k_min^2/s^2.
  constexpr double s = 0.5;
  const Eigen::Matrix3d C = Eigen::Vector3d(s * s, s * s / 2.0, s * s).asDiagonal();
  const DiscriminationThresholds t = DiscriminationThresholds::atLevel(kLevel);
  const auto type = [&](double k1, double k2) {
    return discriminate(curvatures(k1, k2, 0.4), C, t, FitOptions{});
  };
  const double plane = s * std::sqrt(t.plane);
  EXPECT_EQ(type(0.0, 0.999 * plane), SurfaceType::Plane);
  EXPECT_EQ(type(0.0, 1.001 * plane), SurfaceType::CylindricParaboloid);
  const double circular = s * std::sqrt(2.0 * t.circular);
  EXPECT_EQ(type(9.0, 9.0 - 0.999 * circular), SurfaceType::CircularParaboloid);
  EXPECT_EQ(type(9.0, 9.0 - 1.001 * circular), SurfaceType::EllipticParaboloid);
  const double cylindric = s * std::sqrt(t.cylindric);
  EXPECT_EQ(type(9.0, -0.999 * cylindric), SurfaceType::CylindricParaboloid);
  EXPECT_EQ(type(9.0, -1.001 * cylindric), SurfaceType::HyperbolicParaboloid);
}

TEST(Discrimination, TheSmallerRatioWinsWhereBothSimplerTypesPass)
{
  constexpr double s = 1.0;
  const Eigen::Matrix3d C = Eigen::Vector3d(s * s, s * s / 2.0, s * s).asDiagonal();
  const DiscriminationThresholds t = DiscriminationThresholds::atLevel(kLevel);
  const auto type = [&](double k1, double k2) {
    return discriminate(curvatures(k1, k2, 1.0), C, t, FitOptions{});
  };
  // (k1 - k2)^2 / 2 / 9.21 against k2^2 / 6.63, both below 1.
  EXPECT_EQ(type(4.0, 1.0), SurfaceType::CylindricParaboloid);
  EXPECT_EQ(type(4.0, 2.4), SurfaceType::CircularParaboloid);
}

TEST(Discrimination, ToleranceIsAFloorHoweverSureTheDataAre)
{
  constexpr double sure = 1e-6;
  FitOptions options;
  options.curvature_tolerance_per_m = 0.5;
  EXPECT_EQ(decided(curvatures(0.4, -0.3, 0.2), sure, options), SurfaceType::Plane);
  EXPECT_EQ(decided(curvatures(4.4, 4.0, 0.2), sure, options),
            SurfaceType::CircularParaboloid);
  EXPECT_EQ(decided(curvatures(4.4, 0.4, 0.2), sure, options),
            SurfaceType::CylindricParaboloid);
  options.curvature_tolerance_per_m = 0.0;
  EXPECT_EQ(decided(curvatures(0.4, -0.3, 0.2), sure, options),
            SurfaceType::HyperbolicParaboloid);
  EXPECT_EQ(decided(curvatures(4.4, 4.0, 0.2), sure, options),
            SurfaceType::EllipticParaboloid);
}

TEST(Discrimination, ThePapersRuleLooksAtTheToleranceAlone)
{
  const FitOptions paper = FitOptions::paper();
  constexpr double unsure = 10.0;
  const auto type = [&](double k1, double k2) {
    return decided(curvatures(k1, k2, -0.7), unsure, paper);
  };
  EXPECT_EQ(type(0.09, -0.09), SurfaceType::Plane);
  EXPECT_EQ(type(0.09, -2.0), SurfaceType::CylindricParaboloid);
  EXPECT_EQ(type(2.09, 2.0), SurfaceType::CircularParaboloid);
  EXPECT_EQ(type(2.11, 2.0), SurfaceType::EllipticParaboloid);
  EXPECT_EQ(type(2.0, -2.0), SurfaceType::HyperbolicParaboloid);
}

// The types of the robot's patches are recognised from their points. Errors of 4 % are
// allowed in general; 40 trials give at most 6 of them with a probability of 0.998.
TEST(Discrimination, TypesAreRecognisedFromNoisyPoints)
{
  constexpr int kTrials = 40, kAllowed = 6;
  for (const PatchType type : {kPatchTypes[0],
                               kPatchTypes[1],
                               kPatchTypes[2],
                               kPatchTypes[3],
                               kPatchTypes[4]}) {
    int wrong = 0;
    for (std::uint64_t i = 0; i < kTrials; ++i) {
      Random random(i);
      const test::Sample sample =
          test::sampleScene(robotScene(type, 0.8, 0.5, random.uniform(0.0, 6.28)),
                            1.0,
                            random.engine());
      FitOptions options;
      PointBatch batch = test::batchOf(sample);
      wrong += PatchFitter(options).fit(batch).bounded.patch.type != type;
    }
    EXPECT_LE(wrong, kAllowed) << test::typeName(type);
  }
}

// A bowl whose curvature is beyond doubt, and rises by kappa d^2/2 within its bounds.
TEST(FlatWithin, CountsWhatBendsByLessAsAPlane)
{
  Random random;
  const PatchType type{SurfaceType::CircularParaboloid, BoundaryType::Circle};
  PointBatch batch = test::batchOf(test::robotSample(type, 0.2, random));
  const PatchFit curved = PatchFitter(FitOptions{}).fit(batch);
  ASSERT_NE(curved.bounded.patch.type.surface, SurfaceType::Plane);
  const double d = curved.bounded.patch.d[0];
  const Eigen::Vector2d kappa = curved.bounded.patch.principalCurvatures();
  const double sagitta = 0.5 * kappa.cwiseAbs().maxCoeff() * d * d;
  const auto surfaceWithin = [&batch](double limit) {
    FitOptions options;
    options.flat_within_m = limit;
    return PatchFitter(options).fit(batch).bounded.patch.type.surface;
  };
  EXPECT_EQ(surfaceWithin(0.5 * sagitta), curved.bounded.patch.type.surface);
  EXPECT_EQ(surfaceWithin(2.0 * sagitta), SurfaceType::Plane);
}

}} // namespace holdfast
