// Surfaces through minimal samples, in random poses.
#include "support/consensus_scene.h"
#include "support/random_patch.h"

#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/surface.h>
#include <holdfast/pcl/impl/sac_engine.h>

#include "pcl/sac_minimal_solvers.h"

#include <limits>

namespace holdfast { namespace {

using test::ConsensusCase;
using test::Random;

// A point of the sheet through the centre; of round ones up to 0.8 of the way to the
// equator.
Eigen::Vector3d
surfacePoint(const Patch& patch, Random& random)
{
  const double k = patch.principalCurvatures().cwiseAbs().maxCoeff();
  const double reach = k > 0.0 ? 0.55 / k : 0.2;
  const double x = random.uniform(-reach, reach);
  const double y = random.uniform(-reach, reach);
  return patch.pose().toWorld({x, y, *height(patch, x, y)});
}

Sample
drawSample(const Patch& patch, unsigned int count, Random& random)
{
  Sample sample;
  while (sample.size() < count)
    sample.push_back(surfacePoint(patch, random));
  return sample;
}

// ---- The solvers themselves, in double precision --------------------------------

constexpr std::uint64_t kCases = 300;

// Rounding of the solvers, amplified by samples that all but miss a dimension.
constexpr double kTolerance = 1e-7;

TEST(PlaneThroughThreePoints, IsThePlane)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch truth = test::randomPatch(random, kPatchTypes[4]);
    const auto found = planeThrough(drawSample(truth, 3, random));
    ASSERT_TRUE(found);
    EXPECT_NEAR(std::abs(found->normal().dot(truth.normal())), 1.0, kTolerance);
    EXPECT_NEAR(distanceToSurface(truth, found->c), 0.0, kTolerance);
  }
}

TEST(SphereThroughFourPoints, IsTheSphere)
{
  int solved = 0;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Eigen::Vector3d centre = random.uniformVector(-2.0, 2.0);
    const double radius = random.uniform(0.02, 0.5);
    Sample sample;
    while (sample.size() < 4)
      sample.emplace_back(centre + radius * random.unitVector());
    const auto found = sphereThrough(sample);
    if (!found)
      continue; // four points of nearly one circle
    ++solved;
    EXPECT_NEAR(-1.0 / found->kappa[0], radius, kTolerance);
    EXPECT_LT((found->c - radius * found->normal() - centre).norm(), kTolerance);
  }
  EXPECT_GT(solved, 0.99 * kCases);
}

// All around the cylinder, not only on one side.
Sample
drawCylinderSample(const Eigen::Vector3d& point,
                   const Eigen::Matrix3d& R,
                   double radius,
                   Random& random)
{
  Sample sample;
  while (sample.size() < 6) {
    const double angle = random.uniform(-3.14, 3.14);
    sample.emplace_back(point + R * Eigen::Vector3d(random.uniform(-0.2, 0.2),
                                                    radius * std::cos(angle),
                                                    radius * std::sin(angle)));
  }
  return sample;
}

TEST(CylinderThroughSixPoints, IsTheCylinder)
{
  int solved = 0;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Eigen::Vector3d point = random.uniformVector(-2.0, 2.0);
    const Eigen::Matrix3d R = random.rotation();
    const double radius = random.uniform(0.02, 0.3);
    const auto found = cylinderThrough(drawCylinderSample(point, R, radius, random));
    if (!found)
      continue;
    const Eigen::Vector3d centre = found->c + found->normal() / found->kappa[0];
    const double error = std::abs(1.0 / found->kappa[0] + radius) +
                         found->pose().R.col(0).cross(R.col(0)).norm() +
                         (centre - point).cross(R.col(0)).norm();
    // Two of the six cylinders may fall together: half the digits then.
    EXPECT_LT(error, 1e-4) << "case " << i;
    solved += error < kTolerance;
  }
  EXPECT_GT(solved, 0.97 * kCases);
}

// ---- Through coefficients, in single precision, for every surface ---------------

class MinimalSample : public testing::TestWithParam<ConsensusCase> {
protected:
  MinimalSample() : engine_(GetParam().request) {}

  std::optional<Patch> solve(const Sample& sample)
  {
    auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    pcl::Indices all;
    for (const Eigen::Vector3d& point : sample) {
      all.push_back(static_cast<int>(cloud->size()));
      cloud->push_back({});
      cloud->back().getVector3fMap() = point.cast<float>();
    }
    RangeCloud range;
    range.points = cloud;
    engine_.setCloud(range);
    const auto coefficients = engine_.solve(all);
    if (!coefficients)
      return std::nullopt;
    return engine_.surfaceFrom(Eigen::VectorXf(*coefficients));
  }

  // How many points of a sample the surface passes through: the sixth of a cylinder
  // only chooses, and two types are imposed on a paraboloid through the sample.
  int pointsOnSurface() const
  {
    switch (GetParam().request) {
    case SurfaceRequest::CircularCylinder:
      return 5;
    case SurfaceRequest::CylindricParaboloid:
    case SurfaceRequest::CircularParaboloid:
      return 0;
    default:
      return static_cast<int>(engine_.sampleSize());
    }
  }

  PatchConsensus engine_;
};

TEST_P(MinimalSample, IsOnTheSurface)
{
  int solved = 0;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const double offset = i % 2 == 0 ? 1.0 : 1000.0;
    Patch truth = test::randomPatch(random, GetParam().type);
    truth.c = random.uniformVector(-offset, offset);
    const Sample sample = drawSample(truth, engine_.sampleSize(), random);
    const auto found = solve(sample);
    if (!found)
      continue;
    ++solved;
    EXPECT_EQ(curvatureParameterCount(found->type.surface),
              curvatureParameterCount(truth.type.surface));
    // Points and coefficients are rounded: a few roundings of the coordinates.
    const double rounding = std::numeric_limits<float>::epsilon() * offset;
    for (int k = 0; k < pointsOnSurface(); ++k)
      EXPECT_NEAR(distanceToSurface(*found, sample[static_cast<std::size_t>(k)]),
                  0.0,
                  20.0 * rounding)
          << "case " << i;
  }
  // Samples of the other kind of paraboloid, or too flat for their rounding, have no
  // solution.
  EXPECT_GT(solved, 0.9 * kCases);
}

TEST_P(MinimalSample, WithoutExtentHasNoSurface)
{
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(i);
    const double offset = i % 2 == 0 ? 1.0 : 1000.0;
    const Eigen::Vector3d origin = random.uniformVector(-offset, offset);
    const Eigen::Vector3d direction = random.unitVector();
    Sample coincident, collinear;
    while (coincident.size() < engine_.sampleSize()) {
      coincident.push_back(origin);
      collinear.emplace_back(origin + random.uniform(-0.1, 0.1) * direction);
    }
    EXPECT_FALSE(solve(coincident));
    EXPECT_FALSE(solve(collinear)) << "case " << i;
  }
}

TEST_P(MinimalSample, InAPlaneHasNoRoundSurface)
{
  const bool round = GetParam().request == SurfaceRequest::Sphere ||
                     GetParam().request == SurfaceRequest::CircularCylinder;
  if (!round)
    GTEST_SKIP() << "only spheres and cylinders have no planes among them";
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(i);
    const double offset = i % 2 == 0 ? 1.0 : 1000.0;
    const Eigen::Vector3d origin = random.uniformVector(-offset, offset);
    const Eigen::Matrix3d R = random.rotation();
    Sample coplanar, circle;
    while (coplanar.size() < engine_.sampleSize()) {
      const double angle = random.uniform(0.0, 6.28);
      const double radius = random.uniform(0.02, 0.1);
      const Eigen::Vector3d d =
          R.leftCols<2>() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      coplanar.emplace_back(origin + radius * d);
      circle.emplace_back(origin + 0.1 * d);
    }
    EXPECT_FALSE(solve(coplanar)) << "case " << i;
    EXPECT_FALSE(solve(circle)) << "case " << i;
  }
}

TEST_P(MinimalSample, OfRepeatedPointsHasNoSurface)
{
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(i);
    const Patch truth = test::randomPatch(random, GetParam().type);
    Sample sample = drawSample(truth, engine_.sampleSize(), random);
    sample[1] = sample[0];
    // The sixth point of a cylinder does not determine it, so it may be any.
    EXPECT_FALSE(solve(sample)) << "case " << i;
  }
}

TEST_P(MinimalSample, WithAPointThatIsNotFiniteHasNoSurface)
{
  Random random;
  const Patch truth = test::randomPatch(random, GetParam().type);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity()}) {
    Sample sample = drawSample(truth, engine_.sampleSize(), random);
    sample.back().y() = bad;
    EXPECT_FALSE(solve(sample));
  }
}

// ---- Coefficients ---------------------------------------------------------------

TEST_P(MinimalSample, CoefficientsKeepTheSurface)
{
  for (std::uint64_t i = 0; i < 100; ++i) {
    Random random(i);
    const Patch truth = test::randomPatch(random, GetParam().type);
    const SurfaceCoefficients coefficients = engine_.coefficientsOf(truth);
    ASSERT_EQ(coefficients.size(), engine_.modelSize());
    const auto back = engine_.surfaceFrom(Eigen::VectorXf(coefficients));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->type.surface, truth.type.surface);
    // A rounding of coordinates of 2 m and of angles.
    for (int k = 0; k < 10; ++k)
      EXPECT_NEAR(distanceToSurface(*back, surfacePoint(truth, random)), 0.0, 1e-6);
  }
}

TEST_P(MinimalSample, CoefficientsThatMakeNoSurfaceAreRefused)
{
  Random random;
  const Eigen::VectorXf good =
      engine_.coefficientsOf(test::randomPatch(random, GetParam().type));
  EXPECT_TRUE(engine_.surfaceFrom(good));
  EXPECT_FALSE(engine_.surfaceFrom(Eigen::VectorXf()));
  EXPECT_FALSE(engine_.surfaceFrom(good.head(good.size() - 1)));
  for (Eigen::Index i = 0; i < good.size(); ++i) {
    Eigen::VectorXf bad = good;
    bad[i] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(engine_.surfaceFrom(bad));
  }
  // Without normal, radius, axis: but any paraboloid may be flat.
  const bool may_be_flat = GetParam().request == SurfaceRequest::Auto ||
                           GetParam().request == SurfaceRequest::Paraboloid;
  EXPECT_EQ(engine_.surfaceFrom(Eigen::VectorXf::Zero(good.size())).has_value(),
            may_be_flat);
}

INSTANTIATE_TEST_SUITE_P(All,
                         MinimalSample,
                         testing::ValuesIn(test::consensusCases()),
                         test::consensusCaseName);

}} // namespace holdfast
