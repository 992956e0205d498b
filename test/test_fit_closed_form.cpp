// Patches that are known without a fit: exact points, sampled symmetrically about the
// patch's axes, give their own surface back.
//
// Why that holds: the surface through all points has cost zero, so it is the minimum
// whatever the weights. By symmetry the centroid lies on the local z axis and the
// principal axes are the local ones, so the line of a paraboloid's centre is that axis
// and meets the surface in the apex; and the moments of the points are sums over the
// sample. What remains is rounding, and the iterations' own tolerance, which for exact
// points is far below 1e-8.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include "fit/boundary_fit.h"
#include "fit/fit_patch.h"

#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/surface.h>
#include <holdfast/patch_estimator.h>

namespace holdfast { namespace {

using test::Random;

constexpr double kSigma = 1e-3; // of every coordinate
constexpr double kTolerance = 1e-8;

// (x, y) over the rectangle +-half, symmetric in both; more in x than in y, so that
// the larger moment of a plane is that of x.
std::vector<Eigen::Vector2d>
symmetricGrid(const Eigen::Vector2d& half)
{
  constexpr int kSteps = 9;
  std::vector<Eigen::Vector2d> grid;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j)
      grid.emplace_back(half.x() * (2.0 * i / (kSteps - 1) - 1.0),
                        half.y() * (2.0 * j / (kSteps - 1) - 1.0));
  return grid;
}

// The points in the frame of the pose, with isotropic covariances.
test::Sample
sampleOf(const std::vector<Eigen::Vector3d>& local, const Pose& pose)
{
  test::Sample sample;
  for (const Eigen::Vector3d& q : local) {
    sample.points.push_back(pose.toWorld(q));
    sample.covariances.push_back(kSigma * kSigma * Eigen::Matrix3d::Identity());
  }
  sample.viewpoint = pose.toWorld({0.2, -0.1, 1.0});
  return sample;
}

FitResult
fitted(const test::Sample& sample, FitOptions options)
{
  PointBatch batch = test::batchOf(sample);
  return estimatePatch(batch, options);
}

// Half extents of the sample: equal for types that have one bound.
Eigen::Vector2d
extentOf(PatchType type)
{
  return boundaryParameterCount(type.boundary) == 1 ? Eigen::Vector2d(0.08, 0.08) :
                                                      Eigen::Vector2d(0.1, 0.06);
}

// Bounds of stages II-4 to II-9 from the sample's second moments m, of which the fit
// subtracts the noise's share.
Eigen::Matrix<double, 5, 1>
expectedBounds(PatchType type, const Eigen::Vector2d& m)
{
  const double factor =
      std::sqrt(squaredBoundPerMoment(type.surface, FitOptions{}.containment));
  Eigen::Matrix<double, 5, 1> d = Eigen::Matrix<double, 5, 1>::Zero();
  if (type.boundary == BoundaryType::Quad) {
    d.head<4>().setConstant(factor * std::sqrt(m.sum()));
    d[4] = std::atan2(std::sqrt(m.y()), std::sqrt(m.x()));
  }
  else {
    d[0] = factor * std::sqrt(m.x());
    if (type.boundary != BoundaryType::Circle)
      d[1] = factor * std::sqrt(m.y());
  }
  return d;
}

// What the fit must give back: `shape` at its own pose, bounds from the moments.
struct Case {
  test::Sample sample;
  Patch expected;
};

Case
symmetricCase(Patch shape, Random& random)
{
  const Pose pose = test::randomPose(random);
  std::vector<Eigen::Vector3d> local;
  Eigen::Vector2d moments = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& xy : symmetricGrid(extentOf(shape.type))) {
    local.emplace_back(xy.x(), xy.y(), height(shape, xy.x(), xy.y()).value());
    moments += xy.cwiseAbs2();
  }
  moments = (moments / static_cast<double>(local.size())).array() - kSigma * kSigma;
  shape.d = expectedBounds(shape.type, moments);
  return {sampleOf(local, pose), transformed(shape, pose)};
}

class ClosedForm : public testing::TestWithParam<PatchType> {};

TEST_P(ClosedForm, ExactSymmetricPointsGiveTheirPatchBack)
{
  for (std::uint64_t i = 0; i < 10; ++i)
    for (const Residual residual : {Residual::Sampson, Residual::Ray}) {
      Random random(i);
      Patch shape; // at the origin
      shape.type = GetParam();
      shape.kappa = test::randomCurvatures(random, shape.type.surface);
      const Case test = symmetricCase(shape, random);
      FitOptions options = test::optionsFor(GetParam());
      options.residual = residual;
      const FitResult result = fitted(test.sample, options);
      ASSERT_TRUE(isUsable(result.status)) << statusName(result.status);
      EXPECT_EQ(result.patch.type, test.expected.type);
      EXPECT_LT((pack(result.patch) - pack(test.expected)).cwiseAbs().maxCoeff(),
                kTolerance)
          << "fitted   " << pack(result.patch).transpose() << "\nexpected "
          << pack(test.expected).transpose();
      EXPECT_LT(result.chi2, 1e-12);
      EXPECT_EQ(validityError(result.patch), "");
    }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         ClosedForm,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

// ---- Arcs too wide for a height field ----------------------------------------------

// Centre of a sphere, or the point of a cylinder's axis below the patch's centre.
Eigen::Vector3d
centreOfCurvature(const Patch& patch)
{
  return patch.c + patch.normal() / patch.kappa[0];
}

// A sphere's cap of the half-angle about +z, sampled evenly in angle.
std::vector<Eigen::Vector3d>
spherePoints(double radius, double half_angle)
{
  std::vector<Eigen::Vector3d> points{{0.0, 0.0, radius}};
  for (int ring = 1; ring <= 8; ++ring)
    for (int i = 0; i < 16; ++i) {
      const double t = half_angle * ring / 8.0, p = 6.283185307179586 * i / 16.0;
      points.emplace_back(radius * std::sin(t) * std::cos(p),
                          radius * std::sin(t) * std::sin(p),
                          radius * std::cos(t));
    }
  return points;
}

// A pipe along x, its arc of the half-angle about +z.
std::vector<Eigen::Vector3d>
pipePoints(double radius, double half_length, double half_angle)
{
  std::vector<Eigen::Vector3d> points;
  for (int i = -8; i <= 8; ++i)
    for (int j = -8; j <= 8; ++j) {
      const double t = half_angle * j / 8.0;
      points.emplace_back(half_length * i / 8.0,
                          radius * std::sin(t),
                          radius * std::cos(t));
    }
  return points;
}

constexpr double kPi = 3.141592653589793;
constexpr double kRadius = 0.15;

TEST(ClosedFormWideArc, CapsOfASphereGiveRadiusAndCentre)
{
  for (const double half_angle : {0.3 * kPi, 0.5 * kPi})
    for (std::uint64_t i = 0; i < 5; ++i) {
      Random random(i);
      const Pose pose = test::randomPose(random);
      FitOptions options;
      options.surface = SurfaceRequest::Sphere;
      const FitResult result =
          fitted(sampleOf(spherePoints(kRadius, half_angle), pose), options);
      ASSERT_TRUE(isUsable(result.status))
          << half_angle << ": " << statusName(result.status);
      EXPECT_NEAR(1.0 / result.patch.kappa[0], -kRadius, kTolerance);
      EXPECT_LT((centreOfCurvature(result.patch) - pose.c).norm(), kTolerance);
    }
}

// Seen from all around, a sphere has no normal or side of its own, but it has a centre.
TEST(ClosedFormWideArc, AWholeSphereGivesRadiusAndCentre)
{
  for (const double half_angle : {0.8 * kPi, kPi})
    for (std::uint64_t i = 0; i < 5; ++i) {
      Random random(i);
      const Pose pose = test::randomPose(random);
      FitOptions options;
      options.surface = SurfaceRequest::Sphere;
      PointBatch batch =
          test::batchOf(sampleOf(spherePoints(kRadius, half_angle), pose));
      const PatchFit fit = PatchFitter(options).fit(batch);
      ASSERT_EQ(fit.surface.status, FitStatus::Converged);
      const UnboundedSurface& sphere = fit.surface.surface;
      EXPECT_NEAR(std::abs(1.0 / sphere.k[0]), kRadius, kTolerance);
      const Eigen::Vector3d centre =
          batch.origin() + sphere.c + sphere.R.col(2) / sphere.k[0];
      EXPECT_LT((centre - pose.c).norm(), kTolerance);
    }
}

TEST(ClosedFormWideArc, ASphereSeenFromInsideIsABowl)
{
  Random random;
  const Pose pose = test::randomPose(random);
  test::Sample sample = sampleOf(spherePoints(kRadius, 0.4 * kPi), pose);
  sample.viewpoint = pose.c;
  FitOptions options;
  options.surface = SurfaceRequest::Sphere;
  const FitResult result = fitted(sample, options);
  ASSERT_TRUE(isUsable(result.status)) << statusName(result.status);
  EXPECT_NEAR(1.0 / result.patch.kappa[0], kRadius, kTolerance);
  EXPECT_LT((centreOfCurvature(result.patch) - pose.c).norm(), kTolerance);
}

// Where a pipe is long enough to tell its axis from the normal: the extent along the
// axis exceeds that along z.
TEST(ClosedFormWideArc, PipesGiveRadiusAndAxis)
{
  for (const auto& [half_length, half_angle] : {std::pair(0.1, 0.3 * kPi),
                                                std::pair(0.1, 0.5 * kPi),
                                                std::pair(0.4, 0.5 * kPi),
                                                std::pair(0.4, 0.8 * kPi),
                                                std::pair(0.4, kPi)})
    for (std::uint64_t i = 0; i < 5; ++i) {
      Random random(i);
      const Pose pose = test::randomPose(random);
      FitOptions options;
      options.surface = SurfaceRequest::CircularCylinder;
      const FitResult result =
          fitted(sampleOf(pipePoints(kRadius, half_length, half_angle), pose), options);
      ASSERT_TRUE(isUsable(result.status))
          << half_length << " " << half_angle << ": " << statusName(result.status);
      EXPECT_NEAR(std::abs(1.0 / result.patch.kappa[0]), kRadius, kTolerance);
      const Eigen::Vector3d axis = pose.R.col(0);
      EXPECT_LT(result.patch.pose().R.col(0).cross(axis).norm(), kTolerance);
      EXPECT_LT((centreOfCurvature(result.patch) - pose.c).cross(axis).norm(),
                kTolerance);
    }
}

}} // namespace holdfast
