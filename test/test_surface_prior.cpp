// What a map tells of all its surfaces, and what that does to one of them.
#include "support/random.h"
#include "support/risk_map.h"

#include <holdfast/contact/contact_risk.h>
#include <holdfast/geometry/gaussian.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace holdfast { namespace {

using Eigen::Vector3d;
using test::Random;

constexpr double kRadius = 0.08;
const Vector3d kDown = -Vector3d::UnitZ();

/// Curvatures of an isotropic field.
Vector3d
drawCurvature(double scale, Random& random)
{
  Eigen::Matrix3d S;
  S << 1.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 1.0;
  return scale * squareRoot(S) *
         Vector3d(random.normal(), random.normal(), random.normal());
}

/// Patches apart from each other, level ground and bent rocks, as a map has measured
/// them, and their true curvatures.
struct Scene {
  PatchMap map;
  std::vector<Vector3d> truth;
  std::vector<bool> is_rock;
};

Scene
scene(int count, double rocks, Random& random)
{
  PatchMap::Snapshot empty;
  empty.options.radius_m = kRadius;
  empty.options.volume_radius_m = 100.0;
  empty.pose.R = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  empty.pose.c << 2.0, 3.0, 20.0; // so far that none is seen at a graze
  const Pose to_sensor = empty.pose.inverse();
  std::vector<Measurement> measurements;
  std::vector<Vector3d> truth;
  std::vector<bool> rock;
  for (int i = 0; i < count; ++i) {
    const bool is_rock = random.uniform(0.0, 1.0) < rocks;
    const double slope = is_rock ? 0.3 : 0.02;
    Pose anchor;
    anchor.R = Eigen::Quaterniond::FromTwoVectors(
                   Vector3d::UnitZ(),
                   Vector3d(slope * random.normal(), slope * random.normal(), 1.0))
                   .toRotationMatrix();
    anchor.c = {3.0 * kRadius * (i % 20), 3.0 * kRadius * (i / 20), -1.5};
    Measurement m = test::groundMeasurement(static_cast<std::uint64_t>(i + 1),
                                            to_sensor * anchor,
                                            kRadius);
    rock.push_back(is_rock);
    truth.push_back(drawCurvature(is_rock ? 6.0 : 0.1, random));
    m.jet.white.diagonal().tail<3>().setConstant(1.0);
    m.jet.value.tail<3>() =
        truth.back() + Vector3d(random.normal(), random.normal(), random.normal());
    measurements.push_back(m);
  }
  PatchMap map(empty);
  map.update(measurements);
  return {std::move(map), std::move(truth), std::move(rock)};
}

TEST(SurfacePrior, FindsTheKindsThatThereAre)
{
  for (std::uint64_t run = 0; run < 5; ++run) {
    Random random(run);
    const Scene s = scene(600, 0.3, random);
    ASSERT_EQ(s.map.patches().size(), 600u);
    const SurfacePrior prior = surfacePriorOf(s.map, kDown);
    ASSERT_FALSE(prior.kinds.empty());
    double shares = 0.0, level = 0.0, rocks = 0.0, squared = 0.0;
    for (const SurfaceKind& kind : prior.kinds) {
      shares += kind.share;
      (kind.curvature_per_m < 2.0 ? level : rocks) += kind.share;
      if (kind.curvature_per_m >= 2.0)
        squared += kind.share * kind.curvature_per_m * kind.curvature_per_m;
    }
    EXPECT_NEAR(shares, 1.0, 0.01);
    // Binomial: 0.3 +- 0.02, three sigmas, and what is mistaken for the other.
    EXPECT_NEAR(rocks, 0.3, 0.08);
    // 180 rocks with three numbers each: 6 +- 0.2.
    EXPECT_NEAR(std::sqrt(squared / rocks), 6.0, 0.9);
  }
}

/// The error of what is expected is what is said of it, and far less than measured.
TEST(SurfacePrior, MakesCurvaturesBetterAndSaysHowGood)
{
  for (std::uint64_t run = 0; run < 5; ++run) {
    Random random(run);
    const Scene s = scene(600, 0.3, random);
    const SurfacePrior prior = surfacePriorOf(s.map, kDown);
    double nees[2] = {}, squared = 0.0, measured = 0.0;
    int count[2] = {};
    for (std::size_t i = 0; i < s.truth.size(); ++i) {
      const MapPatch& patch = s.map.patches()[i];
      const ContactSurface surface = contactSurfaceOf(s.map, patch, prior);
      const Vector3d error = surface.jet.value.tail<3>() - s.truth[i];
      const Eigen::Matrix3d C = surface.jet.covariance().bottomRightCorner<3, 3>();
      nees[s.is_rock[i]] += error.dot(C.llt().solve(error)) / 3.0;
      ++count[s.is_rock[i]];
      squared += error.squaredNorm();
      measured += (patch.jet.value().tail<3>() - s.truth[i]).squaredNorm();
    }
    EXPECT_LT(squared, 0.5 * measured);
    // Ground is flatter than the noise lets see, so that less is said of it than is
    // so; a rock that passes for ground errs more.
    EXPECT_LT((nees[0] + nees[1]) / (count[0] + count[1]), 1.1);
    EXPECT_LT(nees[0] / count[0], 1.0);
    EXPECT_GT(nees[1] / count[1], 0.8);
    EXPECT_LT(nees[1] / count[1], 2.0);
  }
}

/// Mean and covariance over the hypotheses are those of the surface.
TEST(SurfacePrior, HypothesesMakeUpTheSurface)
{
  Random random;
  const Scene s = scene(200, 0.3, random);
  const SurfacePrior prior = surfacePriorOf(s.map, kDown);
  for (const MapPatch& patch : s.map.patches()) {
    const ContactSurface surface = contactSurfaceOf(s.map, patch, prior);
    ASSERT_FALSE(surface.hypotheses.empty());
    JetVector mean = JetVector::Zero();
    double share = 0.0;
    for (const SurfaceHypothesis& h : surface.hypotheses) {
      share += h.share;
      mean += h.share * h.jet.value;
      EXPECT_TRUE(isPositiveSemiDefinite(h.jet.covariance()));
    }
    EXPECT_NEAR(share, 1.0, 1e-12);
    EXPECT_LT((mean - surface.jet.value).norm(), 1e-9);
    EXPECT_TRUE(isPositiveSemiDefinite(surface.jet.covariance()));
  }
}

TEST(SurfacePrior, IsNoneForAHandfulOfPatches)
{
  Random random;
  const Scene s = scene(20, 0.5, random);
  const SurfacePrior prior = surfacePriorOf(s.map, kDown);
  EXPECT_TRUE(prior.kinds.empty());
  const MapPatch& patch = s.map.patches().front();
  const ContactSurface surface = contactSurfaceOf(s.map, patch, prior);
  EXPECT_TRUE(surface.hypotheses.empty());
  EXPECT_EQ(surface.jet.value, patch.jet.value());
  // A load from the side: nothing faces it.
  EXPECT_TRUE(
      surfacePriorOf(scene(200, 0.0, random).map, Vector3d::UnitX()).kinds.empty());
}

}} // namespace holdfast
