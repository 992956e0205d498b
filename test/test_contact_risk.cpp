// Contact risk: closed forms against draws of the surface, and what must not matter.
#include "support/random.h"

#include <holdfast/contact/contact_risk.h>
#include <holdfast/evaluation/contact_referee.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace holdfast { namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Random;

constexpr double kRadius = 0.12;

SupportGrid
fullSupport()
{
  SupportGrid grid;
  grid.mark(0.0, 0.0, 2.0 * SupportGrid::kReach);
  return grid;
}

/// A surface whose risks are neither none nor certain, as a depth camera knows it: a
/// random covariance about a radius of kRadius.
ContactSurface
randomSurface(Random& random)
{
  ContactSurface surface;
  surface.radius_m = kRadius;
  surface.support = fullSupport();
  surface.anchor.R =
      expMap(random.uniformVector(-3.0, 3.0).normalized() * random.uniform(0.0, 3.0));
  surface.anchor.c = random.uniformVector(-2.0, 2.0);
  JetVector sigma;
  const double slope = random.uniform(0.005, 0.15);
  sigma << random.uniform(0.001, 0.01), slope, slope * random.uniform(0.3, 1.0), 1.0,
      1.0, 1.0;
  sigma.tail<3>() *= random.uniform(0.1, 2.0);
  const JetMatrix mix = JetMatrix::Identity() +
                        0.25 * JetMatrix::NullaryExpr([&] { return random.normal(); });
  surface.jet.white = symmetrized(
      JetMatrix(sigma.asDiagonal() * mix * mix.transpose() * sigma.asDiagonal()));
  surface.jet.value << random.uniform(-0.01, 0.01), random.uniform(-0.3, 0.3),
      random.uniform(-0.3, 0.3), random.uniform(-3.0, 3.0), random.uniform(-1.0, 1.0),
      random.uniform(-3.0, 3.0);
  return surface;
}

Foot
randomFoot(Random& random)
{
  Foot foot = rectangularFoot(random.uniform(0.06, 0.2), random.uniform(0.04, 0.1));
  if (random.integer(0, 3) == 0)
    foot.sole.pop_back(); // a triangle
  if (random.integer(0, 1) == 0)
    foot.curvature = {random.uniform(-1.0, 3.0), random.uniform(-1.0, 3.0)};
  foot.ankle = random.integer(0, 1) == 0 ? Ankle::Stiff : Ankle::Compliant;
  foot.friction = {random.uniform(0.25, 0.6), random.uniform(0.0, 0.15)};
  foot.tolerances.height_m = random.uniform(0.005, 0.02);
  foot.tolerances.tilt_rad = random.uniform(0.02, 0.2);
  foot.tolerances.gap_m = random.uniform(0.001, 0.006);
  foot.tolerances.contact_m = random.uniform(0.0005, 0.003);
  return foot;
}

/// Near the anchor, the load near the normal.
Placement
randomPlacement(const ContactSurface& surface, Random& random)
{
  Placement placement;
  placement.point = surface.anchor.toWorld(
      {random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), surface.jet.value[0]});
  placement.load_direction =
      -(surface.anchor.R *
        Vector3d(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1.0));
  placement.yaw = random.uniform(-3.0, 3.0);
  return placement;
}

/// Of gap and joint probability, which are integrals over lines.
struct QuadratureError {
  double squares = 0.0;
  int count = 0;

  void add(double error)
  {
    // Four times the root mean square that is asked for at the end.
    EXPECT_LT(std::abs(error), 0.012);
    squares += error * error;
    ++count;
  }
  double rms() const
  {
    return std::sqrt(squares / count);
  }
};

void
expectRiskOfDraws(int cases, double s3_per_m2)
{
  constexpr int kDraws = 500000;
  QuadratureError gap, joint;
  for (int i = 0; i < cases; ++i) {
    Random random(static_cast<std::uint64_t>(i));
    ContactSurface surface = randomSurface(random);
    surface.s3_per_m2 = s3_per_m2;
    const Foot foot = randomFoot(random);
    const Placement placement = randomPlacement(surface, random);
    const ContactRisk result = contactRisk(surface, foot, placement);
    ASSERT_EQ(result.status, ContactStatus::Ok);
    const ContactEvents& risk = result.quality->risk;
    const ContactEvents counts =
        *drawnContactEvents(surface, foot, placement, kDraws, random.engine());
    // FUSION F10: 0.003, of which the draws alone have a sigma of up to 0.0007.
    EXPECT_NEAR(risk.slip, counts.slip, 0.003);
    EXPECT_NEAR(risk.height, counts.height, 0.003);
    EXPECT_NEAR(risk.tilt, counts.tilt, 0.003);
    gap.add(risk.gap - counts.gap);
    joint.add(risk.joint - counts.joint);
    // F10, too; slip and tilt of a stiff ankle are nearly the same event.
    if (counts.joint > 1e-3 && counts.joint < 0.3) {
      EXPECT_GT(risk.total / counts.joint, 0.95);
      EXPECT_LT(risk.total / counts.joint, foot.ankle == Ankle::Stiff ? 2.0 : 1.2);
    }
  }
  EXPECT_LT(gap.rms(), 0.003);
  EXPECT_LT(joint.rms(), 0.004); // its events are not all rounded by the lines
}

TEST(ContactRisk, IsThatOfDrawsOfTheSurface)
{
  expectRiskOfDraws(16, 0.0);
}

TEST(ContactRisk, IsThatOfDrawsWithThirdDerivatives)
{
  expectRiskOfDraws(8, 60.0);
}

/// What a robot sees need not be its world.
TEST(ContactRisk, DoesNotDependOnTheFrame)
{
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(i);
    ContactSurface surface = randomSurface(random);
    surface.s3_per_m2 = 30.0;
    const Foot foot = randomFoot(random);
    Placement placement = randomPlacement(surface, random);
    const Pose before = loadFrame(placement);
    const ContactRisk one = contactRisk(surface, foot, placement);

    Pose T;
    T.R = expMap(random.uniformVector(-1.0, 1.0));
    T.c = random.uniformVector(-5.0, 5.0);
    surface.anchor = T * surface.anchor;
    placement.point = T.toWorld(placement.point);
    placement.load_direction = T.R * placement.load_direction;
    // The same heading: yaw counts from the frame's own x axis.
    const Vector3d turned = loadFrame(placement).R.transpose() * T.R * before.R.col(0);
    placement.yaw += std::atan2(turned.y(), turned.x());
    const ContactRisk other = contactRisk(surface, foot, placement);

    ASSERT_EQ(one.status, ContactStatus::Ok);
    ASSERT_EQ(other.status, ContactStatus::Ok);
    // Lines are in single precision; the closed forms differ by rounding.
    EXPECT_NEAR(one.quality->risk.slip, other.quality->risk.slip, 1e-7);
    EXPECT_NEAR(one.quality->risk.gap, other.quality->risk.gap, 1e-4);
    EXPECT_NEAR(one.quality->risk.joint, other.quality->risk.joint, 1e-4);
    const Pose pose = T * one.quality->pose;
    EXPECT_TRUE(pose.R.isApprox(other.quality->pose.R, 1e-9));
    EXPECT_TRUE(pose.c.isApprox(other.quality->pose.c, 1e-9));
  }
}

TEST(ContactRisk, YawsAreTurnsOfOnePlacement)
{
  Random random;
  const ContactSurface surface = randomSurface(random);
  const Foot foot = randomFoot(random);
  Placement placement = randomPlacement(surface, random);
  constexpr int kYaws = 8;
  const std::vector<ContactRisk> all = contactRisks(surface, foot, placement, kYaws);
  ASSERT_EQ(all.size(), static_cast<std::size_t>(kYaws));
  const double first = placement.yaw;
  for (int i = 0; i < kYaws; ++i) {
    placement.yaw = first + 2.0 * kPi * i / kYaws;
    const ContactQuality one = *contactRisk(surface, foot, placement).quality;
    const ContactQuality& other = *all[static_cast<std::size_t>(i)].quality;
    // The nodes of the lines lie otherwise.
    EXPECT_NEAR(one.risk.total, other.risk.total, 0.012);
    EXPECT_NEAR(one.contact_area_m2, other.contact_area_m2, 1e-9);
    EXPECT_TRUE(one.pose.R.isApprox(other.pose.R, 1e-9));
    EXPECT_TRUE(one.pose_covariance.isApprox(other.pose_covariance, 1e-9));
  }
}

/// The covariance of the sole's pose, by finite differences.
TEST(ContactRisk, PoseOfTheSoleFollowsTheSurface)
{
  for (std::uint64_t i = 0; i < 10; ++i) {
    Random random(i);
    ContactSurface surface = randomSurface(random);
    Foot foot = randomFoot(random);
    foot.ankle = Ankle::Compliant;
    const Placement placement = randomPlacement(surface, random);
    const ContactQuality quality = *contactRisk(surface, foot, placement).quality;
    constexpr double kStep = 1e-6;
    const JetVector value = surface.jet.value;
    JetMatrix J;
    for (int k = 0; k < 6; ++k) {
      Pose moved[2];
      for (int side = 0; side < 2; ++side) {
        surface.jet.value[k] = value[k] + (side == 0 ? kStep : -kStep);
        moved[side] = contactRisk(surface, foot, placement).quality->pose;
      }
      surface.jet.value = value;
      J.col(k) << logMap(moved[1].R.transpose() * moved[0].R), moved[0].c - moved[1].c;
    }
    J /= 2.0 * kStep;
    const JetMatrix expected = J * surface.jet.covariance() * J.transpose();
    EXPECT_LT((quality.pose_covariance - expected).norm(), 1e-5 * expected.norm());
  }
}

/// Nothing is said where nothing was seen.
TEST(ContactRisk, AsksForSupport)
{
  Random random;
  ContactSurface surface = randomSurface(random);
  const Foot foot = rectangularFoot(0.2, 0.1);
  Placement placement;
  placement.point = surface.anchor.toWorld({0.0, 0.0, surface.jet.value[0]});
  placement.load_direction = -surface.anchor.R.col(2);
  EXPECT_EQ(contactRisk(surface, foot, placement).status, ContactStatus::Ok);

  surface.support = SupportGrid();
  surface.support.mark(0.0, 0.0, 0.5); // 6 cm about the middle
  const ContactRisk beyond = contactRisk(surface, foot, placement);
  EXPECT_EQ(beyond.status, ContactStatus::InsufficientSupport);
  EXPECT_FALSE(beyond.quality.has_value());
  EXPECT_GT(beyond.support_share, 0.3);
  EXPECT_LT(beyond.support_share, 0.9);

  placement.load_direction = surface.anchor.R.col(0);
  EXPECT_EQ(contactRisk(surface, foot, placement).status,
            ContactStatus::NotFacingTheLoad);
}

TEST(ContactRisk, RefusesFeetAndPlacementsThatMakeNoSense)
{
  Random random;
  const ContactSurface surface = randomSurface(random);
  const Foot good = rectangularFoot(0.2, 0.1);
  const auto expectRefused = [&](const auto& change) {
    Foot foot = good;
    change(foot);
    EXPECT_NE(validityError(foot), "");
    EXPECT_THROW(contactRisk(surface, foot, Placement()), std::invalid_argument);
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(validityError(good), "");
  expectRefused([](Foot& f) { f.sole.resize(2); });
  expectRefused([](Foot& f) { std::swap(f.sole[0], f.sole[1]); }); // crosses itself
  expectRefused([](Foot& f) { f.sole[1] = f.sole[0]; });
  expectRefused([](Foot& f) { f.sole = {{0.0, 0.0}, {0.1, 0.0}, {0.05, 0.0}}; });
  expectRefused([&](Foot& f) { f.sole[2].x() = kNaN; });
  expectRefused([](Foot& f) { f.friction.mean = -0.5; });
  expectRefused([&](Foot& f) { f.friction.sigma = kNaN; });
  expectRefused([](Foot& f) { f.tolerances.gap_m = -0.001; });
  expectRefused([&](Foot& f) { f.tolerances.height_m = kNaN; });
  expectRefused([](Foot& f) { f.tolerances.tilt_rad = 1.6; });
  expectRefused([](Foot& f) { f.tolerances.min_support = 1.5; });

  const auto expectMisplaced = [&](const Placement& placement) {
    EXPECT_NE(validityError(placement), "");
    EXPECT_THROW(contactRisk(surface, good, placement), std::invalid_argument);
  };
  Placement placement;
  placement.load_direction.setZero();
  expectMisplaced(placement);
  placement.load_direction = {0.0, 0.0, kNaN};
  expectMisplaced(placement);
  placement = Placement();
  placement.sole_normal = -Vector3d::UnitZ(); // away from the load
  expectMisplaced(placement);
}

}} // namespace holdfast
