#include "support/finite_difference.h"
#include "support/random_patch.h"

#include <holdfast/geometry/pose.h>
#include <holdfast/geometry/rotation.h>

namespace holdfast { namespace {

using test::numericalJacobian;
using test::Random;
using test::randomPose;
using test::scaledError;

constexpr int kCases = 20;

// Coordinates of a few metres through a few products.
constexpr double kRounding = 1e-14;

// The pose moved by (delta, c) in the library's convention R <- R Exp(delta).
Pose
moved(const Pose& pose, const Eigen::VectorXd& step)
{
  return {pose.R * expMap(step.head<3>()), pose.c + step.tail<3>()};
}

TEST(Pose, ToLocalInvertsToWorld)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Pose pose = randomPose(random);
    const Eigen::Vector3d q = random.normalVector();
    EXPECT_LT((pose.toLocal(pose.toWorld(q)) - q).norm(), kRounding);
    EXPECT_LT((pose.inverse().toWorld(q) - pose.toLocal(q)).norm(), kRounding);
  }
}

TEST(Pose, ProductAppliesTheRightFactorFirst)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Pose a = randomPose(random);
    const Pose b = randomPose(random);
    const Eigen::Vector3d q = random.normalVector();
    EXPECT_LT(((a * b).toWorld(q) - a.toWorld(b.toWorld(q))).norm(), kRounding);
  }
}

TEST(Pose, JacobiansAreTheDerivatives)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Pose pose = randomPose(random);
    const Eigen::Vector3d q = random.normalVector();
    const auto to_world = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
      return moved(pose, step).toWorld(q);
    };
    const auto to_local = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
      return moved(pose, step).toLocal(q);
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6);
    // Error of the differences: see numericalJacobian().
    EXPECT_LT(scaledError(pose.toWorldJacobian(q), numericalJacobian(to_world, zero)),
              1e-11);
    EXPECT_LT(scaledError(pose.toLocalJacobian(q), numericalJacobian(to_local, zero)),
              1e-11);
  }
}

}} // namespace holdfast
