// The regular state of a patch: to the parameters and back, and its covariance where
// the parameters have none.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/state.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/transforms.h>

#include <gtest/gtest.h>

namespace holdfast { namespace {

using test::Random;

class State : public testing::TestWithParam<PatchType> {};

constexpr double kContainment = 0.95;

TEST_P(State, RoundTripKeepsThePatch)
{
  Random random;
  for (int i = 0; i < 100; ++i) {
    Patch patch = test::randomPatch(random, GetParam());
    if (GetParam().boundary == BoundaryType::Quad)
      patch.d.head<4>().setConstant(patch.d[0]); // what moments can tell
    patch = canonical(patch);
    const Patch back = toPatch(toState(patch, kContainment), kContainment);
    const Patch near = nearestRepresentation(back, patch);
    EXPECT_LT((pack(near) - pack(patch)).cwiseAbs().maxCoeff(), 1e-9)
        << pack(patch).transpose() << "\n"
        << pack(near).transpose();
  }
}

TEST_P(State, RoundTripKeepsTheState)
{
  Random random;
  for (int i = 0; i < 100; ++i) {
    const PatchState state =
        toState(test::randomPatch(random, GetParam()), kContainment);
    const PatchState back = unpackState(state.type, pack(state), state.normal);
    EXPECT_LT(difference(back, state).cwiseAbs().maxCoeff(), 1e-12);
    const PatchState again = toState(toPatch(state, kContainment), kContainment);
    const StateVector error = difference(again, state);
    const StateVector scale = pack(state).cwiseAbs().array() + 1.0;
    EXPECT_LT(error.cwiseQuotient(scale).cwiseAbs().maxCoeff(), 1e-9)
        << error.transpose();
  }
}

// The fit's state and its parameters are two descriptions of one patch.
TEST_P(State, OfAFitGivesItsParameters)
{
  Random random;
  for (int i = 0; i < 20; ++i) {
    PointBatch batch = test::batchOf(test::robotSample(GetParam(), 1.0, random));
    const FitResult fit = estimatePatch(batch, test::optionsFor(GetParam()));
    ASSERT_TRUE(isUsable(fit.status));
    const Patch patch = toPatch(fit.state, kContainment);
    const Patch near = nearestRepresentation(patch, fit.patch);
    const ParameterVector scale = pack(fit.patch).cwiseAbs().array() + 1.0;
    EXPECT_LT((pack(near) - pack(fit.patch)).cwiseQuotient(scale).cwiseAbs().maxCoeff(),
              1e-9)
        << pack(near).transpose() << "\n"
        << pack(fit.patch).transpose();
  }
}

TEST_P(State, DifferenceIsAStepOfTheCoordinates)
{
  Random random;
  for (int i = 0; i < 50; ++i) {
    const PatchState a = toState(test::randomPatch(random, GetParam()), kContainment);
    const StateLayout layout = stateLayoutOf(a.type);
    const Eigen::Vector2d nu(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4));
    // A frame turned without twist sees the same numbers.
    PatchState b = a;
    const Eigen::Matrix3d R = a.frame() * expMap({nu.x(), nu.y(), 0.0});
    b.normal = R.col(2);
    const Eigen::Matrix3d W = b.frame().transpose() * R;
    const auto turned = [&W](const Eigen::Vector3d& m) {
      Eigen::Matrix2d M;
      M << m[0], m[1], m[1], m[2];
      M = (W.topLeftCorner<2, 2>() * M * W.topLeftCorner<2, 2>().transpose()).eval();
      return Eigen::Vector3d(M(0, 0), M(0, 1), M(1, 1));
    };
    b.moments = turned(a.moments);
    b.curvature = turned(a.curvature);
    StateVector expected = StateVector::Zero(layout.size());
    expected.segment<2>(layout.nu()) = nu;
    EXPECT_LT((difference(b, a) - expected).cwiseAbs().maxCoeff(), 1e-9);
  }
}

// Moving points and patch is moving the patch.
TEST_P(State, TransformsLikeThePoints)
{
  Random random;
  for (int i = 0; i < 20; ++i) {
    const test::Sample sample = test::robotSample(GetParam(), 1.0, random);
    const Pose T = test::randomPose(random);
    PointBatch here = test::batchOf(sample),
               there = test::batchOf(test::transformed(sample, T));
    const FitOptions options = test::optionsFor(GetParam());
    const FitResult moved = transformed(estimatePatch(here, options), T);
    const FitResult fit = estimatePatch(there, options);
    ASSERT_TRUE(isUsable(fit.status));
    EXPECT_LT(difference(moved.state, fit.state).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT(test::normalizedDifference(moved.state_covariance, fit.state_covariance),
              1e-5);
  }
}

// A camera exactly before a wall or a ball: every fit is usable, and the sigma of the
// normal is finite and that of a view a little from the side.
TEST_P(State, HoldsWhereTheCameraLooksStraightAtThePatch)
{
  Random random;
  const auto sigmaAt = [&](double tilt) {
    const ReferenceScene scene = robotScene(GetParam(), 1.0, tilt, 0.3);
    PointBatch batch = test::batchOf(test::sampleScene(scene, 1.0, random.engine()));
    const FitResult fit = estimatePatch(batch, test::optionsFor(GetParam()));
    EXPECT_TRUE(isUsable(fit.status)) << statusName(fit.status);
    return normalSigma(fit);
  };
  const double frontal = sigmaAt(0.0), aside = sigmaAt(0.1);
  EXPECT_GT(frontal, 0.5 * aside);
  EXPECT_LT(frontal, 2.0 * aside);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         State,
                         testing::ValuesIn(kPatchTypes),
                         [](const auto& tested) {
                           return test::typeName(tested.param);
                         });

}} // namespace holdfast
