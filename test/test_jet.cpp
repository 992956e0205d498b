// Jets of fitted surfaces: derivatives, and what does not depend on where they are
// taken.
#include "support/finite_difference.h"
#include "support/patch_batch.h"
#include "support/random_patch.h"
#include "support/spot.h"

#include <holdfast/fusion/jet.h>
#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/rotation.h>

#include <gtest/gtest.h>

namespace holdfast { namespace {

using test::Random;

/// Jets in units in which their entries are about one over a patch of 5 cm.
JetVector
unitsOf()
{
  constexpr double kRadius = 0.05;
  return (JetVector() << kRadius, 1.0, 1.0, 1.0 / kRadius, 1.0 / kRadius, 1.0 / kRadius)
      .finished();
}

JetVector
randomJet(Random& random)
{
  JetVector jet;
  for (int i = 0; i < 6; ++i)
    jet[i] = random.uniform(-0.2, 0.2);
  return jet.cwiseProduct(unitsOf());
}

/// A frame within a patch's radius of another, tilted and turned.
Pose
nearbyPose(Random& random)
{
  Pose pose;
  const Eigen::Vector3d turn = random.uniformVector(-0.2, 0.2);
  pose.R = expMap(turn + Eigen::Vector3d(0.0, 0.0, random.uniform(-3.0, 3.0)));
  pose.c = random.uniformVector(-0.03, 0.03);
  return pose;
}

FitResult
paraboloid(Random& random)
{
  PointBatch batch = test::batchOf(
      test::robotSample({SurfaceType::EllipticParaboloid, BoundaryType::Ellipse},
                        1.0,
                        random));
  FitOptions options;
  options.surface = SurfaceRequest::Paraboloid;
  return estimatePatch(batch, options);
}

/// The fit with its surface moved by [kxx kxy kyy | nu | c].
FitResult
moved(FitResult fit, const Eigen::VectorXd& step)
{
  const Eigen::Matrix3d R = fit.state.frame() * expMap({step[3], step[4], 0.0});
  // In the axes that frameFromZ() has for the new normal.
  fit.state.normal = R.col(2);
  const Eigen::Matrix3d W = R.transpose() * fit.state.frame();
  Eigen::Matrix2d K;
  const Eigen::Vector3d k = fit.state.curvature + step.head<3>();
  K << k[0], k[1], k[1], k[2];
  const Eigen::Matrix2d w = W.topLeftCorner<2, 2>();
  K = w.transpose() * K * w;
  fit.state.curvature = {K(0, 0), K(0, 1), K(1, 1)};
  fit.state.centre += step.tail<3>();
  return fit;
}

TEST(Jet, OfAFitAtItsOwnAnchorIsItsCurvature)
{
  Random random;
  for (int i = 0; i < 20; ++i) {
    const FitResult fit = paraboloid(random);
    ASSERT_TRUE(isUsable(fit.status));
    const auto jet = jetAt(fit, ownAnchor(fit));
    ASSERT_TRUE(jet);
    EXPECT_LT(jet->value.head<3>().cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_LT((jet->value.tail<3>() - fit.state.curvature).cwiseAbs().maxCoeff(),
              1e-13);
    // Height and curvature are those of the state.
    const int k = stateLayoutOf(fit.state.type).k();
    const Eigen::Matrix3d S = fit.state_covariance.block<3, 3>(k, k);
    EXPECT_LT(test::scaledError(jet->white.bottomRightCorner<3, 3>() / S.trace(),
                                S / S.trace()),
              1e-12);
    EXPECT_NEAR(std::sqrt(jet->white(0, 0)), centreSigma(fit, fit.state.normal), 1e-12);
  }
}

// Through the derivatives of the state and of the parameters the same covariance comes
// out: the solver's and the patch's are one.
TEST(Jet, CovarianceIsByFiniteDifferences)
{
  Random random;
  for (int i = 0; i < 20; ++i) {
    const FitResult fit = paraboloid(random);
    ASSERT_TRUE(isUsable(fit.status));
    const Pose anchor = ownAnchor(fit) * nearbyPose(random);
    const auto jet = jetAt(fit, anchor);
    ASSERT_TRUE(jet);
    const JetVector unit = unitsOf().cwiseInverse();
    Eigen::VectorXd scale(8);
    scale << 20.0, 20.0, 20.0, 1.0, 1.0, 0.05, 0.05, 0.05;
    const Eigen::MatrixXd J = test::numericalJacobian(
        [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
          return unit.cwiseProduct(
              jetAt(moved(fit, scale.cwiseProduct(x)), anchor)->value);
        },
        Eigen::VectorXd::Zero(8));
    const int k = stateLayoutOf(fit.state.type).k();
    const Eigen::MatrixXd S = fit.state_covariance.block(k, k, 8, 8);
    const Eigen::MatrixXd by_state = J * scale.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd expected = by_state * S * by_state.transpose();
    const JetMatrix actual = unit.asDiagonal() * jet->covariance() * unit.asDiagonal();
    // F1: 1e-7 of the largest.
    EXPECT_LT((actual - expected).cwiseAbs().maxCoeff() /
                  expected.cwiseAbs().maxCoeff(),
              1e-7);
  }
}

TEST(Jet, MovesByItsDerivatives)
{
  Random random;
  const JetVector unit = unitsOf().cwiseInverse();
  for (int i = 0; i < 50; ++i) {
    const JetVector jet = randomJet(random);
    const Pose to = nearbyPose(random);
    ThirdToJet disc = ThirdToJet::Zero();
    if (i % 2 == 1)
      disc = movedThirdToJet(thirdToJetOfDisc(0.05), nearbyPose(random));
    const auto there = movedJet(jet, to, disc);
    ASSERT_TRUE(there);
    const auto value = [&](const JetVector& j, const Pose& pose) -> Eigen::VectorXd {
      return unit.cwiseProduct(movedJet(j, pose, disc)->value);
    };
    const Eigen::MatrixXd by_jet = test::numericalJacobian(
        [&](const Eigen::VectorXd& x) {
          return value(jet + unitsOf().cwiseProduct(x), to);
        },
        Eigen::VectorXd::Zero(6));
    EXPECT_LT(
        test::scaledError(unit.asDiagonal() * there->by_jet * unitsOf().asDiagonal(),
                          by_jet),
        1e-7);
    constexpr double kLength = 0.05;
    const Eigen::MatrixXd by_pose = test::numericalJacobian(
        [&](const Eigen::VectorXd& x) {
          return value(jet, {to.R * expMap(x.head<3>()), to.c + kLength * x.tail<3>()});
        },
        Eigen::VectorXd::Zero(6));
    JetVector scale = JetVector::Ones();
    scale.tail<3>() *= kLength;
    EXPECT_LT(test::scaledError(unit.asDiagonal() * there->by_pose * scale.asDiagonal(),
                                by_pose),
              1e-7);
  }
}

TEST(Jet, IsTheSurfaceThatTheFitHas)
{
  Random random;
  for (int i = 0; i < 50; ++i) {
    const FitResult fit = paraboloid(random);
    const Pose own = ownAnchor(fit), anchor = own * nearbyPose(random);
    const auto jet = jetAt(fit, anchor);
    ASSERT_TRUE(jet);
    // Both ways to the same place agree.
    const auto direct = jetAt(fit, own);
    const auto moved = transported(*direct, own, anchor);
    ASSERT_TRUE(moved);
    const JetVector unit = unitsOf().cwiseInverse();
    EXPECT_LT(unit.cwiseProduct(moved->value - jet->value).cwiseAbs().maxCoeff(),
              1e-12);
    // And the height is that of the surface, to third order: 3 k^2 slope x^3 / 6 of a
    // paraboloid about a tilted axis.
    const double x = 1e-3, y = -2e-3;
    const Eigen::Vector3d q = own.toLocal(anchor.toWorld({x, y, jet->height(x, y)}));
    const Eigen::Vector3d& k = fit.state.curvature;
    EXPECT_NEAR(q.z(),
                0.5 * (k[0] * q.x() * q.x() + 2.0 * k[1] * q.x() * q.y() +
                       k[2] * q.y() * q.y()),
                2e-7);
  }
}

// An error of the sensor's pose moves the jet as the surface's own motion does.
TEST(Jet, MotionIsTheDerivativeOfTransport)
{
  Random random;
  const JetVector unit = unitsOf().cwiseInverse();
  for (int i = 0; i < 50; ++i) {
    const JetVector jet = randomJet(random);
    const Eigen::Vector3d pivot = random.uniformVector(-1.0, 1.0);
    const Eigen::MatrixXd expected = test::numericalJacobian(
        [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
          const Eigen::VectorXd step = 0.05 * x;
          // p -> R (p - pivot) + pivot + t of the surface.
          Pose motion;
          motion.R = expMap(step.head<3>());
          motion.c = pivot - motion.R * pivot + step.tail<3>();
          return unit.cwiseProduct(movedJet(jet, motion.inverse())->value);
        },
        Eigen::VectorXd::Zero(6));
    EXPECT_LT(
        test::scaledError(0.05 * unit.asDiagonal() * jetByMotion(jet, pivot), expected),
        1e-7);
  }
}

TEST(Jet, IsNoneWhereThereIsNone)
{
  Random random;
  FitResult fit = paraboloid(random);
  Pose aside = ownAnchor(fit);
  aside.R = aside.R * expMap({1.55, 0.0, 0.0});
  EXPECT_FALSE(jetAt(fit, aside));
  fit.status = FitStatus::Degenerate;
  EXPECT_FALSE(jetAt(fit, ownAnchor(fit)));
  EXPECT_FALSE(movedJet(JetVector::Zero(), {expMap({1.55, 0.0, 0.0}), aside.c}));
}

TEST(Roughness, BestQuadricIsThatOfLeastSquares)
{
  Random random;
  constexpr double kRadius = 0.05;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector4d third = test::randomThirdDerivatives(random, 100.0);
    const Scene scene = test::reliefScene(third, Eigen::Vector3d::Zero());
    const auto best = trueJet(scene, Pose(), kRadius);
    ASSERT_TRUE(best);
    const JetVector expected = thirdToJetOfDisc(kRadius) * third;
    EXPECT_LT(unitsOf().cwiseInverse().cwiseProduct(*best - expected).norm(), 1e-9);
    const Eigen::Vector2d offset(random.uniform(-0.01, 0.01),
                                 random.uniform(-0.01, 0.01));
    Pose aside;
    aside.c.head<2>() = offset;
    aside.R = expMap({0.0, 0.0, random.uniform(-3.0, 3.0)});
    // The quadric over the other disc, written about the same anchor.
    const auto there = trueJet(scene, aside, kRadius);
    ASSERT_TRUE(there);
    const auto back = movedJet(*there, aside.inverse());
    ASSERT_TRUE(back);
    const JetVector other = movedThirdToJet(thirdToJetOfDisc(kRadius), aside) * third;
    EXPECT_LT(unitsOf().cwiseInverse().cwiseProduct(back->value - other).norm(), 1e-9);
  }
  EXPECT_TRUE(modelError(thirdToJetOfDisc(kRadius), thirdToJetOfDisc(kRadius), 100.0)
                  .isZero(0.0));
}

}} // namespace holdfast
