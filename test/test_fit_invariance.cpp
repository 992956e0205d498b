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
