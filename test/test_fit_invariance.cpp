// What a fit must not depend on: the frame of the cloud and the order of its points;
// and the conventions that every patch follows.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch_estimator.h>

#include <algorithm>
#include <numeric>

namespace holdfast { namespace {

using test::Random;
using test::Sample;

// Differences in units of sigma, and of correlation. The estimate is converged to 1e-6
// sigma and then takes one more step, which squares that.
constexpr double kTolerance = 1e-9;

class FitInvariance : public testing::TestWithParam<PatchType> {};

FitResult
fitted(const Sample& sample, FitOptions options)
{
  // The tolerance of the iterations is not what is tested here.
  options.polish_tolerance_sigma = 1e-9;
  PointBatch batch = test::batchOf(sample);
  return estimatePatch(batch, options);
}

// Covariance of [d | k | delta | c] of a patch moved by T: the tangent of the rotation
// turns with the local frame, c with the world. Where the canonical x axis flips, the
// local frame turns by pi about z.
ParameterMatrix
movedTangentCovariance(const FitResult& result, const Pose& T, const Patch& moved)
{
  const ParameterLayout layout = layoutOf(result.patch.type);
  const ParameterMatrix S = toTangent(result.patch, result.covariance);
  ParameterMatrix J = ParameterMatrix::Identity(S.rows(), S.cols());
  J.bottomRightCorner<3, 3>() = T.R;
  const Eigen::Matrix3d turn = moved.pose().R.transpose() * T.R * result.patch.pose().R;
  J.block(layout.r(), layout.r(), layout.r_count, layout.r_count) =
      turn.topLeftCorner(layout.r_count, layout.r_count);
  return J * S * J.transpose();
}

// Largest difference of two patches' parameters in their own sigmas, r in the tangent
// space, where it has no seam at pi.
double
differenceInSigmas(const Patch& a, const Patch& b, const ParameterMatrix& tangent)
{
  const ParameterLayout layout = layoutOf(a.type);
  ParameterVector difference = pack(a) - pack(b);
  const Eigen::Vector3d delta = logMap(b.pose().R.transpose() * a.pose().R);
  difference.segment(layout.r(), layout.r_count) = delta.head(layout.r_count);
  return (difference.array() / tangent.diagonal().array().sqrt()).abs().maxCoeff();
}

void
expectEquivariant(const Sample& sample,
                  const Pose& T,
                  const FitOptions& options,
                  double tolerance)
{
  const FitResult result = fitted(sample, options);
  const FitResult moved = fitted(transformed(sample, T), options);
  ASSERT_EQ(moved.status, result.status);
  ASSERT_TRUE(isUsable(result.status)) << statusName(result.status);
  ASSERT_EQ(moved.patch.type, result.patch.type);
  const Patch expected = holdfast::transformed(result.patch, T);
  const ParameterMatrix S = movedTangentCovariance(result, T, expected);
  EXPECT_LT(differenceInSigmas(moved.patch, expected, S), tolerance);
  EXPECT_LT(test::normalizedDifference(toTangent(moved.patch, moved.covariance), S),
            tolerance);
}

std::vector<FitOptions>
variants()
{
  FitOptions ray, paper = FitOptions::paper();
  ray.residual = Residual::Ray;
  // The paper's radius is that of the axis, of two, along which the points reach
  // farther; for revolute types the axes depend on the world's frame.
  paper.smooth_circle_radius = true;
  return {FitOptions{}, ray, paper};
}

TEST_P(FitInvariance, FitMovesWithTheCloud)
{
  for (std::uint64_t i = 0; i < 10; ++i)
    for (const FitOptions& options : variants()) {
      Random random(i);
      const Sample sample = test::robotSample(GetParam(), 1.0, random);
      expectEquivariant(sample,
                        test::randomPose(random),
                        test::optionsFor(GetParam(), options),
                        kTolerance);
    }
}

TEST_P(FitInvariance, FitMovesWithTheCloudThroughRotationsNearPi)
{
  for (std::uint64_t i = 0; i < 10; ++i) {
    Random random(i);
    const Sample sample = test::robotSample(GetParam(), 1.0, random);
    Pose T = test::randomPose(random);
    const double short_of_pi = i == 0 ? 0.0 : random.uniform(-1e-3, 1e-3);
    T.R = expMap((3.141592653589793 - short_of_pi) * random.unitVector());
    expectEquivariant(sample, T, test::optionsFor(GetParam()), kTolerance);
  }
}

// Points of a sphere, a circular paraboloid or a plane that a camera at the origin
// looks at exactly along their normal, whose r_xy would be the singularity of its
// chart.
Sample
frontalSample(PatchType type, const Eigen::Vector3d& centre, double kappa)
{
  Sample sample;
  constexpr int kHalf = 8;
  constexpr double kStep = 0.012, kSigma = 1e-3;
  for (int i = -kHalf; i <= kHalf; ++i)
    for (int j = -kHalf; j <= kHalf; ++j) {
      const double x = kStep * i, y = kStep * j, s2 = x * x + y * y;
      if (s2 > 0.0101)
        continue;
      const double z = type.surface == SurfaceType::Plane ?
                           0.0 :
                       type.surface == SurfaceType::Sphere ?
                           kappa * s2 / (1.0 + std::sqrt(1.0 - kappa * kappa * s2)) :
                           0.5 * kappa * s2;
      sample.points.emplace_back(centre + Eigen::Vector3d(x, y, -z));
      sample.covariances.push_back(kSigma * kSigma * Eigen::Matrix3d::Identity());
    }
  return sample;
}

void
expectSameAsInARotatedFrame(const Sample& sample,
                            const Pose& T,
                            const FitOptions& options,
                            double kappa)
{
  const FitResult result = fitted(sample, options);
  const FitResult moved = fitted(transformed(sample, T), options);
  ASSERT_TRUE(isUsable(moved.status)) << statusName(moved.status);
  ASSERT_TRUE(isUsable(result.status)) << statusName(result.status);
  EXPECT_LT((result.patch.normal() + Eigen::Vector3d::UnitZ()).norm(), 2e-6);
  EXPECT_NEAR(result.patch.kappa.x(), kappa, 1e-6);
  EXPECT_TRUE(result.patch.c.isApprox(T.inverse().toWorld(moved.patch.c), 1e-9));
  const Patch expected = holdfast::transformed(result.patch, T);
  const ParameterMatrix S = movedTangentCovariance(result, T, expected);
  EXPECT_LT(test::normalizedDifference(toTangent(moved.patch, moved.covariance), S),
            1e-3);
}

TEST_P(FitInvariance, WhatIsSeenExactlyFrontallyIsFittedAsInAnyFrame)
{
  const PatchType type = GetParam();
  if (!isRevolute(type))
    GTEST_SKIP() << "r of this type has no singularity at a normal of -z";
  const bool flat = type.surface == SurfaceType::Plane;
  for (const Eigen::Vector3d& centre : {Eigen::Vector3d(0.0, 0.0, 1.0),
                                        Eigen::Vector3d(0.0, 0.0, 0.45),
                                        Eigen::Vector3d(0.3, -0.2, 0.9),
                                        Eigen::Vector3d(-0.7, 0.6, 1.4)})
    for (const double kappa : {-5.0, 4.0}) {
      Random random(static_cast<std::uint64_t>(kappa + 10.0));
      const Sample sample = frontalSample(type, centre, kappa);
      const Pose T = test::randomPose(random);
      for (const FitOptions& options : variants())
        expectSameAsInARotatedFrame(sample,
                                    T,
                                    test::optionsFor(type, options),
                                    flat ? 0.0 : kappa);
    }
}

// A kilometre away coordinates are rounded by 1e-13 m each, 1e-10 of their sigmas of
// some millimetres; a fit moves by less than the worst of them, and its covariance by
// the same share, both amplified by at most the condition of the problem, some ten.
TEST_P(FitInvariance, FitMovesWithTheCloudFarAway)
{
  constexpr double kFarTolerance = 1e-8;
  for (std::uint64_t i = 0; i < 10; ++i) {
    Random random(i);
    const Sample sample = test::robotSample(GetParam(), 1.0, random);
    const Pose T = test::randomPose(random, 1e3);
    expectEquivariant(sample, T, test::optionsFor(GetParam()), kFarTolerance);
  }
}

TEST_P(FitInvariance, OrderOfThePointsDoesNotMatter)
{
  for (std::uint64_t i = 0; i < 10; ++i)
    for (const FitOptions& variant : variants()) {
      Random random(i);
      const Sample sample = test::robotSample(GetParam(), 1.0, random);
      Sample shuffled = sample;
      std::vector<std::size_t> order(sample.points.size());
      std::iota(order.begin(), order.end(), 0U);
      std::shuffle(order.begin(), order.end(), random.engine());
      for (std::size_t k = 0; k < order.size(); ++k) {
        shuffled.points[k] = sample.points[order[k]];
        shuffled.covariances[k] = sample.covariances[order[k]];
      }
      const FitOptions options = test::optionsFor(GetParam(), variant);
      const FitResult a = fitted(sample, options);
      const FitResult b = fitted(shuffled, options);
      ASSERT_EQ(a.status, b.status);
      ASSERT_TRUE(isUsable(a.status)) << statusName(a.status);
      const ParameterMatrix S = toTangent(a.patch, a.covariance);
      EXPECT_LT(differenceInSigmas(a.patch, b.patch, S), kTolerance);
      EXPECT_LT(test::normalizedDifference(b.covariance, a.covariance), kTolerance);
    }
}

// ---- Conventions -------------------------------------------------------------------

TEST_P(FitInvariance, PatchesFollowTheConventions)
{
  for (std::uint64_t i = 0; i < 60; ++i) {
    Random random(i);
    const Sample sample = transformed(test::robotSample(GetParam(), 1.0, random),
                                      test::randomPose(random));
    const FitResult result = fitted(sample, test::optionsFor(GetParam()));
    if (result.status == FitStatus::CurvatureSignMismatch)
      continue;
    ASSERT_TRUE(isUsable(result.status)) << statusName(result.status);
    const Patch& patch = result.patch;
    EXPECT_EQ(validityError(patch), "");
    EXPECT_LE(patch.r.norm(), 3.141592653589793 + 1e-15);
    EXPECT_GT(patch.normal().dot(sample.viewpoint - patch.c), 0.0);
    // r_z = 0, or else the x axis looks to positive world x.
    EXPECT_EQ(isRevolute(patch.type) ? patch.r.z() : 0.0, 0.0);
    EXPECT_TRUE(isRevolute(patch.type) || patch.pose().R(0, 0) >= -1e-12);
    const Eigen::Vector2d kappa = patch.principalCurvatures();
    EXPECT_LE(std::abs(kappa.x()), std::abs(kappa.y()));
    // Every curved patch of these scenes bends away from the sensor.
    EXPECT_TRUE(patch.type.surface == SurfaceType::Plane || kappa.y() < 0.0);
    EXPECT_TRUE(isPositiveSemiDefinite(toTangent(patch, result.covariance), 1e-9));
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         FitInvariance,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

// Seen from behind, the same points are a bowl.
TEST(FitConventions, TheOtherSideOfARockIsABowl)
{
  for (const PatchType type : kPatchTypes) {
    if (type.surface == SurfaceType::Plane)
      continue;
    SCOPED_TRACE(test::typeName(type));
    Random random;
    Sample sample = test::robotSample(type, 1.0, random);
    const FitResult rock = fitted(sample, test::optionsFor(type));
    sample.viewpoint = -sample.viewpoint;
    const FitResult bowl = fitted(sample, test::optionsFor(type));
    ASSERT_TRUE(isUsable(rock.status) && isUsable(bowl.status));
    EXPECT_LT(rock.patch.principalCurvatures().y(), 0.0);
    EXPECT_GT(bowl.patch.principalCurvatures().y(), 0.0);
    EXPECT_GT(bowl.patch.normal().dot(sample.viewpoint), 0.0);
  }
}

}} // namespace holdfast
