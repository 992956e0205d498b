// Patch against patch: a pad finds how it fits, and how surely.
#include "support/random.h"

#include <holdfast/contact/patch_contact.h>
#include <holdfast/geometry/rotation.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace holdfast { namespace {

using Eigen::Vector3d;
using test::Random;

/// A surface with curvatures along the axes of its anchor, known well.
ContactSurface
surfaceOf(const Eigen::Vector2d& curvature, double sigma_per_m, Random& random)
{
  ContactSurface surface;
  surface.radius_m = 0.1;
  surface.support.mark(0.0, 0.0, 2.0 * SupportGrid::kReach);
  surface.anchor.R = expMap(random.uniformVector(-1.0, 1.0));
  surface.anchor.c = random.uniformVector(-1.0, 1.0);
  surface.jet.value[3] = curvature.x();
  surface.jet.value[5] = curvature.y();
  surface.jet.white.diagonal() << 1e-8, 1e-6, 1e-6,
      Vector3d::Constant(sigma_per_m * sigma_per_m);
  return surface;
}

Placement
onTop(const ContactSurface& surface)
{
  Placement placement;
  placement.point = surface.anchor.c;
  placement.load_direction = -surface.anchor.R.col(2);
  return placement;
}

Foot
padWith(double kx, double ky)
{
  Foot pad = rectangularFoot(0.08, 0.05);
  pad.curvature = {kx, ky};
  return pad;
}

/// A pad with the surface's own shape, however it was turned before.
TEST(PatchContact, FindsTheTurnThatFits)
{
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(i);
    const Eigen::Vector2d k(random.uniform(-6.0, -3.0), random.uniform(2.0, 6.0));
    const ContactSurface surface = surfaceOf(k, 0.01, random);
    Placement placement = onTop(surface);
    placement.yaw = random.uniform(-3.0, 3.0);
    const PatchContact contact =
        patchContact(surface, padWith(k.x(), k.y()), placement);
    ASSERT_EQ(contact.status, ContactStatus::Ok);
    const PatchFitness& fitness = *contact.fitness;
    // A turn of 1e-4 moves the edge by less.
    EXPECT_LT(fitness.gap_m, 5e-6);
    EXPECT_LT(fitness.penetration_m, 5e-6);
    EXPECT_LT(fitness.risk, 1e-6);
    EXPECT_NEAR(std::abs(fitness.pose.R.col(0).dot(surface.anchor.R.col(0))),
                1.0,
                1e-6);
    EXPECT_NEAR(fitness.pose.R.col(2).dot(surface.anchor.R.col(2)), 1.0, 1e-9);
  }
}

TEST(PatchContact, KeepsToTheTurnAndTiltItMay)
{
  Random random;
  const ContactSurface surface = surfaceOf({-5.0, 5.0}, 0.01, random);
  Placement placement = onTop(surface);
  placement.load_direction = -(surface.anchor.R * Vector3d(0.4, 0.0, 1.0).normalized());
  PatchContactOptions options;
  options.max_tilt_rad = 0.1;
  options.max_turn_rad = 0.2;
  const Pose planned = loadFrame(placement);
  const PatchContact contact =
      patchContact(surface, padWith(-5.0, 5.0), placement, options);
  ASSERT_TRUE(contact.fitness);
  const Eigen::Matrix3d& R = contact.fitness->pose.R;
  EXPECT_NEAR(std::acos(R.col(2).dot(planned.R.col(2))), 0.1, 1e-6);
}

/// Over a flat surface a ball of the pad leaves a gap all round: the sagitta of its
/// edge, shared out as the pad may go in.
TEST(PatchContact, SharesTheMisfitOut)
{
  Random random;
  const ContactSurface surface = surfaceOf({0.0, 0.0}, 1e-3, random);
  const Foot pad = padWith(4.0, 4.0);
  PatchContactOptions options;
  options.max_gap_m = 0.02;
  options.max_penetration_m = 0.01;
  const PatchFitness fitness =
      *patchContact(surface, pad, onTop(surface), options).fitness;
  const double sagitta = 0.5 * 4.0 * (0.04 * 0.04 + 0.025 * 0.025);
  // Cells end half a cell before the edge: some fifty of them.
  EXPECT_NEAR(fitness.gap_m + fitness.penetration_m, sagitta, 0.25 * sagitta);
  EXPECT_NEAR(fitness.gap_m / fitness.penetration_m, 2.0, 1e-6);
}

/// The probability that a pad does not fit, against draws of the curvatures.
TEST(PatchContact, RiskIsThatOfDraws)
{
  for (std::uint64_t i = 0; i < 6; ++i) {
    Random random(i);
    const double sigma = 1.5;
    const ContactSurface surface =
        surfaceOf({random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)},
                  sigma,
                  random);
    const Foot pad = padWith(0.0, 0.0);
    PatchContactOptions options;
    options.max_turn_rad = 0.0;
    options.max_gap_m = random.uniform(5e-4, 1.5e-3);
    options.max_penetration_m = random.uniform(5e-4, 1.5e-3);
    const PatchContact contact = patchContact(surface, pad, onTop(surface), options);
    ASSERT_TRUE(contact.fitness);
    // Where the pad was planned, in its own axes.
    const Pose in_anchor = surface.anchor.inverse() * contact.fitness->pose;
    const double lift = in_anchor.c.z();
    const Eigen::Vector2d x = in_anchor.R.topLeftCorner<2, 1>();
    constexpr int kDraws = 100000;
    int misses = 0;
    for (int n = 0; n < kDraws; ++n) {
      const double kxx = surface.jet.value[3] + sigma * random.normal();
      const double kxy = sigma * random.normal();
      const double kyy = surface.jet.value[5] + sigma * random.normal();
      bool misses_somewhere = false;
      for (const double u : {-0.04, 0.0, 0.04})
        for (const double v : {-0.025, 0.0, 0.025}) {
          const Eigen::Vector2d p = u * x + v * Eigen::Vector2d(-x.y(), x.x());
          // Off the plane that lies best under the pad: 1/12 of the sides' squares.
          const double a = 0.08 * 0.08 / 12.0, b = 0.05 * 0.05 / 12.0;
          const double xx = x.x() * x.x() * a + x.y() * x.y() * b;
          const double yy = x.y() * x.y() * a + x.x() * x.x() * b;
          const double xy = x.x() * x.y() * (a - b);
          const double off = 0.5 * kxx * (p.x() * p.x() - xx) +
                             kxy * (p.x() * p.y() - xy) +
                             0.5 * kyy * (p.y() * p.y() - yy) - lift;
          misses_somewhere = misses_somewhere || off > options.max_penetration_m ||
                             off < -options.max_gap_m;
        }
      misses += misses_somewhere ? 1 : 0;
    }
    // As contact risk: lines, and three sigmas of the draws.
    EXPECT_NEAR(contact.fitness->risk, static_cast<double>(misses) / kDraws, 0.012);
    EXPECT_LE(contact.fitness->gap_risk, contact.fitness->risk + 0.012);
    EXPECT_LE(contact.fitness->penetration_risk, contact.fitness->risk + 0.012);
  }
}

/// A palm that is a patch, as a planner has it from a model of the robot.
TEST(PatchContact, TakesAPatchOfTheRobot)
{
  Patch palm;
  palm.type = {SurfaceType::EllipticParaboloid, BoundaryType::Ellipse};
  palm.d << 0.04, 0.03, 0.0, 0.0, 0.0;
  palm.kappa = {-2.0, -6.0}; // a ball's
  const Foot pad = padOf(palm);
  EXPECT_EQ(validityError(pad), "");
  EXPECT_NEAR(soleArea(pad), 3.14159265 * 0.04 * 0.03, 0.02 * soleArea(pad));
  EXPECT_EQ(pad.curvature, Eigen::Vector2d(2.0, 6.0));
  Random random;
  const ContactSurface bowl = surfaceOf({2.0, 6.0}, 0.01, random);
  const PatchContact contact = patchContact(bowl, pad, onTop(bowl));
  ASSERT_TRUE(contact.fitness);
  EXPECT_LT(contact.fitness->risk, 1e-6);
  palm.d[0] = -1.0;
  EXPECT_THROW(padOf(palm), std::invalid_argument);
}

TEST(PatchContact, SaysNothingWithoutSupport)
{
  Random random;
  ContactSurface surface = surfaceOf({0.0, 0.0}, 0.1, random);
  surface.support = SupportGrid();
  const PatchContact contact = patchContact(surface, padWith(0.0, 0.0), onTop(surface));
  EXPECT_EQ(contact.status, ContactStatus::InsufficientSupport);
  EXPECT_FALSE(contact.fitness);
  PatchContactOptions options;
  options.max_gap_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(patchContact(surface, padWith(0.0, 0.0), onTop(surface), options),
               std::invalid_argument);
}

}} // namespace holdfast
