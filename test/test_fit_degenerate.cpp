// Whatever the points are, a fit ends with a status: never an exception, an endless
// loop or a NaN in a result that calls itself usable.
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include "fit/fit_patch.h"
#include "fit/kernel.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/patch_estimator.h>

#include <limits>
#include <stdexcept>

namespace holdfast { namespace {

using test::Random;
using test::Sample;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr SurfaceRequest kRequests[] = {SurfaceRequest::Auto,
                                        SurfaceRequest::Paraboloid,
                                        SurfaceRequest::Plane,
                                        SurfaceRequest::Sphere,
                                        SurfaceRequest::CircularCylinder,
                                        SurfaceRequest::EllipticParaboloid,
                                        SurfaceRequest::HyperbolicParaboloid,
                                        SurfaceRequest::CylindricParaboloid,
                                        SurfaceRequest::CircularParaboloid};
constexpr BoundaryType kBoundaries[] = {BoundaryType::Ellipse,
                                        BoundaryType::Circle,
                                        BoundaryType::Rectangle,
                                        BoundaryType::Quad};

Eigen::Matrix3d
isotropic(double sigma)
{
  return sigma * sigma * Eigen::Matrix3d::Identity();
}

// True when the covariance is finite and symmetric and its correlations have no
// eigenvalue below -1e-6.
bool
isCovariance(const ParameterMatrix& covariance)
{
  if (!covariance.allFinite() || covariance != covariance.transpose() ||
      !(covariance.diagonal().minCoeff() >= 0.0))
    return false;
  ParameterVector scale = covariance.diagonal();
  for (double& s : scale)
    s = s > 0.0 ? 1.0 / std::sqrt(s) : 0.0;
  const ParameterMatrix correlation =
      scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<ParameterMatrix> solver(correlation);
  constexpr double kRounding = 1e-12; // of the eigenvalues themselves
  return solver.eigenvalues()[0] >= -1e-6 - kRounding;
}

// What every result promises.
void
expectSound(const FitResult& result, const Sample& sample)
{
  EXPECT_EQ(result.points + result.invalid_points + result.uninformative_points,
            static_cast<int>(sample.points.size()));
  EXPECT_LE(result.iterations, 2 * FitOptions{}.max_iterations);
  EXPECT_NE(statusName(result.status), "unknown");
  EXPECT_TRUE(result.status == FitStatus::Degenerate || result.null_space->cols() == 0);
  EXPECT_TRUE(result.null_space->allFinite());
  if (!isUsable(result.status)) {
    EXPECT_EQ(result.covariance.size(), 0);
    return;
  }
  EXPECT_EQ(validityError(result.patch), "");
  EXPECT_TRUE(std::isfinite(result.chi2) && result.chi2 >= 0.0);
  ASSERT_EQ(result.covariance.rows(), degreesOfFreedom(result.patch.type));
  EXPECT_TRUE(isCovariance(result.covariance)) << statusName(result.status) << "\n"
                                               << result.covariance;
}

FitResult
fitted(const Sample& sample,
       FitOptions options,
       CovarianceMode mode = CovarianceMode::Exact)
{
  PointBatch batch = test::batchOf(sample);
  const FitResult result = estimatePatch(batch, options, mode);
  expectSound(result, sample);
  return result;
}

FitOptions
requesting(SurfaceRequest request)
{
  FitOptions options;
  options.surface = request;
  return options;
}

// Fits as every request; for planes with every boundary, with the departures and
// without.
template <typename Check>
void
forEveryRequest(const Sample& sample, const Check& check)
{
  for (FitOptions options : {FitOptions{}, FitOptions::paper()})
    for (const SurfaceRequest request : kRequests) {
      options.surface = request;
      for (const BoundaryType boundary : kBoundaries) {
        const bool plane = request == SurfaceRequest::Plane;
        if (!plane && boundary != BoundaryType::Ellipse)
          continue;
        options.plane_boundary =
            plane ? std::optional<BoundaryType>(boundary) : std::nullopt;
        SCOPED_TRACE("request " + std::to_string(static_cast<int>(request)) +
                     (options.debias_scatter ? "" : ", paper"));
        check(request, fitted(sample, options));
      }
    }
}

void
expectStatusForEveryRequest(const Sample& sample, FitStatus status)
{
  forEveryRequest(sample, [&](SurfaceRequest, const FitResult& result) {
    EXPECT_EQ(statusName(result.status), statusName(status));
  });
}

void
expectSoundForEveryRequest(const Sample& sample)
{
  forEveryRequest(sample, [](SurfaceRequest, const FitResult&) {});
}

Sample
sampleOf(const std::vector<Eigen::Vector3d>& points, double sigma = 1e-3)
{
  Sample sample;
  sample.points = points;
  sample.covariances.assign(points.size(), isotropic(sigma));
  sample.viewpoint = {0.1, 0.2, 1.0};
  return sample;
}

// Noisy points on a rock of curvatures -3 and -6, `size` across.
Sample
rock(Random& random, int count, double size = 0.1, double sigma = 1e-3)
{
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(-0.5, 0.5), y = random.uniform(-0.5, 0.5);
    points.push_back(size * Eigen::Vector3d(x, y, -0.3 * (x * x + 2.0 * y * y)) +
                     sigma * random.normalVector());
  }
  return sampleOf(points, sigma);
}

int
surfaceParameters(SurfaceRequest request)
{
  using kernel::Model;
  using kernel::parameterCount;
  return request == SurfaceRequest::Plane  ? parameterCount(Model::Plane) :
         request == SurfaceRequest::Sphere ? parameterCount(Model::Sphere) :
         request == SurfaceRequest::CircularCylinder ?
                                             parameterCount(Model::Cylinder) :
                                             parameterCount(Model::Paraboloid);
}

// ---- Too little ---------------------------------------------------------------------

TEST(FitDegenerate, FewerPointsThanParametersAreTooFew)
{
  for (int count = 0; count < 6; ++count) {
    Random random(static_cast<std::uint64_t>(count));
    const auto expectTooFew = [count](SurfaceRequest request, const FitResult& result) {
      EXPECT_EQ(result.status == FitStatus::TooFewPoints,
                count < surfaceParameters(request));
    };
    forEveryRequest(rock(random, count), expectTooFew);
  }
}

TEST(FitDegenerate, AsManyPointsAsParametersEndSomehow)
{
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(i);
    expectSoundForEveryRequest(rock(random, random.integer(3, 7)));
  }
}

TEST(FitDegenerate, PointsOnALineDetermineNoSurface)
{
  Random random;
  const Eigen::Vector3d along = random.unitVector();
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 40; ++i)
    points.push_back(0.005 * i * along);
  const auto expectUndetermined = [](SurfaceRequest request, const FitResult& result) {
    EXPECT_FALSE(isUsable(result.status)) << statusName(result.status);
    if (request == SurfaceRequest::Plane) {
      EXPECT_EQ(result.status, FitStatus::Degenerate);
      EXPECT_EQ(result.null_space->cols(), 1); // the turn about the line
    }
  };
  forEveryRequest(sampleOf(points), expectUndetermined);
}

TEST(FitDegenerate, OnePointManyTimesHasNoExtent)
{
  const std::vector<Eigen::Vector3d> points(50, Eigen::Vector3d(0.3, 0.2, -0.1));
  expectStatusForEveryRequest(sampleOf(points), FitStatus::Degenerate);
}

TEST(FitDegenerate, CopiesOfThreePointsDetermineAPlaneOnly)
{
  Random random;
  std::vector<Eigen::Vector3d> points;
  for (int copy = 0; copy < 30; ++copy)
    for (const Eigen::Vector3d& q : {Eigen::Vector3d(0.1, 0.0, 0.02),
                                     Eigen::Vector3d(0.0, 0.12, 0.0),
                                     Eigen::Vector3d(-0.1, -0.1, 0.01)})
      points.push_back(q);
  const auto expectPlane = [](SurfaceRequest request, const FitResult& result) {
    EXPECT_EQ(isUsable(result.status), request == SurfaceRequest::Plane)
        << statusName(result.status);
  };
  forEveryRequest(sampleOf(points), expectPlane);
}

// On an exact plane curvatures are zero within their sigma: the type is a plane, and a
// sphere or cylinder that is asked for has no observable radius.
TEST(FitDegenerate, AnExactPlaneHasNoCurvature)
{
  Random random;
  std::vector<Eigen::Vector3d> points;
  const Pose pose = test::randomPose(random);
  for (int i = 0; i < 200; ++i)
    points.push_back(
        pose.toWorld({random.uniform(-0.1, 0.1), random.uniform(-0.07, 0.07), 0.0}));
  Sample sample = sampleOf(points);
  sample.viewpoint = pose.toWorld({0.0, 0.0, 1.0});
  const auto expectFlat = [](SurfaceRequest request, const FitResult& result) {
    switch (request) {
    case SurfaceRequest::Plane:
      EXPECT_EQ(result.status, FitStatus::Converged);
      break;
    case SurfaceRequest::Auto:
      EXPECT_EQ(result.patch.type.surface, SurfaceType::Plane);
      break;
    case SurfaceRequest::Sphere:
    case SurfaceRequest::CircularCylinder:
      EXPECT_NE(result.status, FitStatus::Converged);
      break;
    default: // a paraboloid may have any curvature
      break;
    }
  };
  forEveryRequest(sample, expectFlat);
}

// ---- Numbers that are none, and covariances that are none ---------------------------

TEST(FitDegenerate, InvalidPointsAreCountedAndLeftOut)
{
  Random random;
  const Sample good = rock(random, 100);
  Sample sample = good;
  const auto add = [&](const Eigen::Vector3d& q, const Eigen::Matrix3d& S) {
    const auto at = static_cast<std::ptrdiff_t>(
        random.integer(0, static_cast<int>(sample.points.size())));
    sample.points.insert(sample.points.begin() + at, q);
    sample.covariances.insert(sample.covariances.begin() + at, S);
  };
  Eigen::Matrix3d indefinite = isotropic(1e-3), nan = indefinite;
  indefinite(0, 1) = indefinite(1, 0) = 1e-4;
  nan(2, 2) = kNan;
  add({kNan, 0.0, 0.0}, isotropic(1e-3));
  add({0.0, kInfinity, 0.0}, isotropic(1e-3));
  add({0.0, 0.0, -kInfinity}, isotropic(1e-3));
  add({0.0, 0.0, 0.0}, indefinite);
  add({0.0, 0.0, 0.0}, -isotropic(1e-3));
  add({0.0, 0.0, 0.0}, nan);
  const FitOptions options = requesting(SurfaceRequest::EllipticParaboloid);
  const FitResult result = fitted(sample, options);
  EXPECT_EQ(result.invalid_points, 6);
  EXPECT_EQ(result.points, 100);
  ASSERT_TRUE(isUsable(result.status));
  const FitResult expected = fitted(good, options);
  const ParameterVector sigma = expected.covariance.diagonal().cwiseSqrt();
  EXPECT_LT((pack(result.patch) - pack(expected.patch))
                .cwiseQuotient(sigma)
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
}

TEST(FitDegenerate, NothingValidIsTooFewPoints)
{
  Sample sample = sampleOf(std::vector<Eigen::Vector3d>(30, {kNan, kNan, kNan}));
  expectStatusForEveryRequest(sample, FitStatus::TooFewPoints);
}

TEST(FitDegenerate, ZeroCovariancesGetTheFloor)
{
  Random random;
  Sample zero = rock(random, 100, 0.1, 1e-6), floor = zero;
  zero.covariances.assign(zero.points.size(), Eigen::Matrix3d::Zero());
  floor.covariances.assign(zero.points.size(), isotropic(FitOptions{}.sigma_floor_m));
  const FitOptions options = requesting(SurfaceRequest::EllipticParaboloid);
  const FitResult a = fitted(zero, options), b = fitted(floor, options);
  ASSERT_TRUE(isUsable(a.status) && isUsable(b.status));
  EXPECT_EQ(pack(a.patch), pack(b.patch));
  EXPECT_EQ(a.covariance, b.covariance);
}

// Noise along the line of sight only, as of a lidar.
TEST(FitDegenerate, CovariancesOfRankOneAreFine)
{
  Random random;
  Sample sample = rock(random, 200);
  for (std::size_t i = 0; i < sample.points.size(); ++i) {
    const Eigen::Vector3d ray =
        1e-3 * (sample.points[i] - sample.viewpoint).normalized();
    sample.covariances[i] = ray * ray.transpose();
  }
  for (const SurfaceRequest request : {SurfaceRequest::Plane,
                                       SurfaceRequest::Sphere,
                                       SurfaceRequest::EllipticParaboloid}) {
    const FitResult result = fitted(sample, requesting(request));
    EXPECT_TRUE(isUsable(result.status)) << statusName(result.status);
  }
}

TEST(FitDegenerate, CovariancesOfAnySizeEndSomehow)
{
  for (const double sigma : {1e-15, 1e-6, 1.0, 1e3}) {
    Random random;
    Sample sample = rock(random, 100);
    sample.covariances.assign(sample.points.size(), isotropic(sigma));
    expectSoundForEveryRequest(sample);
    for (std::size_t i = 0; i < sample.points.size(); i += 2)
      sample.covariances[i] = isotropic(1e-3);
    expectSoundForEveryRequest(sample);
  }
}

// Points with a sigma of 1 m among others of 1 mm weigh nothing, even where they lie
// exactly on the surface.
TEST(FitDegenerate, UninformativePointsWeighNothing)
{
  constexpr int kPoints = 100;
  for (std::uint64_t i = 0; i < 100; ++i)
    for (const int poor : {1, 2, 10}) {
      Random random(i);
      const Pose pose = test::randomPose(random);
      const bool flat = random.integer(0, 3) == 0;
      Sample with, without;
      with.viewpoint = without.viewpoint = pose.toWorld({0.1, 0.2, 1.0});
      for (int k = 0; k < kPoints; ++k) {
        const double x = random.uniform(-0.1, 0.1), y = random.uniform(-0.1, 0.1);
        const Eigen::Vector3d q(x, y, flat ? 0.0 : -2.0 * x * x - 2.5 * y * y);
        const bool poorly = k % (kPoints / poor) == 0;
        const double sigma = poorly ? 1.0 : 1e-3;
        const Eigen::Vector3d noise = (poorly ? 0.0 : sigma) * random.normalVector();
        with.points.push_back(pose.toWorld(q + noise));
        with.covariances.push_back(isotropic(sigma));
        if (poorly)
          continue;
        without.points.push_back(with.points.back());
        without.covariances.push_back(with.covariances.back());
      }
      for (const SurfaceRequest request : {SurfaceRequest::Auto,
                                           SurfaceRequest::Plane,
                                           SurfaceRequest::CircularCylinder,
                                           SurfaceRequest::Sphere,
                                           SurfaceRequest::Paraboloid}) {
        const FitResult result = fitted(with, requesting(request));
        const FitResult expected = fitted(without, requesting(request));
        EXPECT_EQ(result.uninformative_points, poor);
        EXPECT_EQ(result.points, kPoints - poor);
        EXPECT_EQ(expected.uninformative_points, 0);
        ASSERT_EQ(statusName(result.status), statusName(expected.status));
        ASSERT_EQ(result.patch.type, expected.patch.type);
        if (!isUsable(result.status))
          continue;
        // The batches differ in their origin: rounding.
        const ParameterVector sigma = expected.covariance.diagonal().cwiseSqrt();
        EXPECT_LT((pack(result.patch) - pack(expected.patch))
                      .cwiseQuotient(sigma)
                      .cwiseAbs()
                      .maxCoeff(),
                  1e-5);
        EXPECT_LT(test::normalizedDifference(result.covariance, expected.covariance),
                  1e-5);
      }
    }
}

// ---- Scales and places --------------------------------------------------------------

TEST(FitDegenerate, SizeOfAPatchDoesNotMatterWithinTheCurvatureLimit)
{
  // The same shape in other units, its curvature within limits that scale along.
  const auto fittedAt = [](double scale) {
    Random random;
    FitOptions options = requesting(SurfaceRequest::EllipticParaboloid);
    options.max_curvature_per_m = 1e3 / scale;
    options.curvature_tolerance_per_m = 0.1 / scale;
    options.sigma_floor_m *= scale;
    Sample sample = rock(random, 100, 0.1 * scale, 1e-3 * scale);
    sample.viewpoint *= scale;
    return fitted(sample, options);
  };
  const FitResult expected = fittedAt(1.0);
  ASSERT_EQ(expected.status, FitStatus::Converged);
  for (const double scale : {1e-5, 1e5}) {
    const FitResult result = fittedAt(scale);
    ASSERT_EQ(result.status, FitStatus::Converged) << scale;
    EXPECT_NEAR(result.patch.kappa.y() * scale / expected.patch.kappa.y(), 1.0, 1e-6);
    EXPECT_NEAR(result.patch.d.x() / scale / expected.patch.d.x(), 1.0, 1e-6);
  }
}

TEST(FitDegenerate, TinyPatchesAreOutOfTheCurvatureRange)
{
  Random random;
  // 10 um across: curvatures of 6e4 1/m.
  const FitResult result =
      fitted(rock(random, 100, 1e-5, 1e-8), requesting(SurfaceRequest::Paraboloid));
  EXPECT_EQ(result.status, FitStatus::CurvatureOutOfRange);
}

TEST(FitDegenerate, AMillionMetresAwayPointsStillFit)
{
  Random random;
  Sample sample = rock(random, 200);
  const Pose T{Eigen::Matrix3d::Identity(), {1e6, -1e6, 1e6}};
  const FitOptions options = requesting(SurfaceRequest::EllipticParaboloid);
  const FitResult near = fitted(sample, options);
  const FitResult far = fitted(transformed(sample, T), options);
  ASSERT_TRUE(isUsable(near.status) && isUsable(far.status));
  // Coordinates there are rounded by 1e-10 m, 1e-7 sigma.
  EXPECT_LT(test::normalizedDifference(far.covariance, near.covariance), 1e-5);
}

TEST(FitDegenerate, AViewpointInThePlaneEndsSomehow)
{
  Random random;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i)
    points.emplace_back(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0.0);
  Sample sample = sampleOf(points);
  sample.viewpoint = {1.0, 0.3, 0.0};
  expectSoundForEveryRequest(sample);
  sample.viewpoint = points.front();
  expectSoundForEveryRequest(sample);
}

// ---- Anything at all ----------------------------------------------------------------

double
randomMagnitude(Random& random, double low_exponent, double high_exponent)
{
  return std::pow(10.0, random.uniform(low_exponent, high_exponent));
}

// A surface's points or a cloud's, of any scale, place and thinness.
Eigen::Vector3d
randomPoint(Random& random, int kind)
{
  const Eigen::Vector3d q = random.uniformVector(-1.0, 1.0);
  switch (kind) {
  case 0:
    return q;
  case 1:
    return {q.x(), q.y(), 0.3 * q.x() * q.y()};
  case 2:
    return {q.x(), q.y(), 0.0};
  case 3:
    return {q.x(), 1e-9 * q.y(), 1e-9 * q.z()};
  case 4:
    return q.normalized();
  case 5:
    return {std::round(2.0 * q.x()), std::round(2.0 * q.y()), std::round(q.z())};
  default:
    return {q.x(), std::cos(3.0 * q.y()), std::sin(3.0 * q.y())};
  }
}

Eigen::Matrix3d
randomNoise(Random& random, double sigma, int kind)
{
  const Eigen::Vector3d v = sigma * random.normalVector();
  switch (kind) {
  case 0:
    return isotropic(sigma);
  case 1:
    return v * v.transpose();
  case 2:
    return Eigen::Matrix3d::Zero();
  case 3:
    return v.cwiseAbs2().asDiagonal();
  case 4: // any symmetric matrix: half of them no covariance
    return sigma * (v * random.normalVector().transpose() +
                    random.normalVector() * v.transpose());
  default:
    return isotropic(randomMagnitude(random, -15.0, 6.0));
  }
}

Sample
randomGarbage(Random& random)
{
  Sample sample;
  const int kind = random.integer(0, 6), noise = random.integer(0, 5);
  const double size = randomMagnitude(random, -6.0, 4.0);
  const double sigma = size * randomMagnitude(random, -6.0, 1.0);
  const double roughness =
      random.integer(0, 1) * size * randomMagnitude(random, -8.0, 0.0);
  const Pose pose = test::randomPose(random, randomMagnitude(random, -3.0, 6.0));
  const int count = random.integer(0, 60);
  for (int i = 0; i < count; ++i) {
    sample.points.push_back(pose.toWorld(size * randomPoint(random, kind) +
                                         roughness * random.normalVector()));
    sample.covariances.push_back(randomNoise(random, sigma, noise));
    if (random.integer(0, 200) == 0)
      sample.points.back()[random.integer(0, 2)] = random.sign() * kInfinity;
    if (random.integer(0, 200) == 0)
      sample.covariances.back()(0, 0) = kNan;
  }
  sample.viewpoint = random.uniformVector(-1e3, 1e3);
  return sample;
}

class FitFuzz : public testing::TestWithParam<int> {};

TEST_P(FitFuzz, EveryInputEndsWithAStatus)
{
  constexpr int kBatches = 100;
  for (int i = 0; i < kBatches && !HasFailure(); ++i) {
    Random random(static_cast<std::uint64_t>(GetParam() * kBatches + i));
    expectSoundForEveryRequest(randomGarbage(random));
  }
}

// 2000 batches.
INSTANTIATE_TEST_SUITE_P(Batches, FitFuzz, testing::Range(0, 20));

// Options at the ends of what they may be, and every mode that has a closed form.
TEST(FitDegenerate, UsableMeansACovarianceUnderExtremeOptions)
{
  constexpr int kDraws = 6000;
  constexpr CovarianceMode kModes[] = {CovarianceMode::Exact,
                                       CovarianceMode::GaussNewton,
                                       CovarianceMode::SecondOrder,
                                       CovarianceMode::Stagewise};
  int usable = 0;
  for (int i = 0; i < kDraws && !testing::Test::HasFailure(); ++i) {
    Random random(static_cast<std::uint64_t>(i));
    FitOptions options = random.integer(0, 1) == 0 ? FitOptions{} : FitOptions::paper();
    options.surface = kRequests[random.integer(0, std::size(kRequests) - 1)];
    if (options.surface == SurfaceRequest::Plane)
      options.plane_boundary = kBoundaries[random.integer(0, 3)];
    constexpr double kContainments[] = {kSmallestContainment,
                                        0.95,
                                        kLargestContainment};
    options.containment = kContainments[random.integer(0, 2)];
    options.max_curvature_per_m = randomMagnitude(random, 0.0, 12.0);
    options.curvature_tolerance_per_m = randomMagnitude(random, -12.0, 3.0);
    options.sigma_floor_m = randomMagnitude(random, -12.0, 0.0);
    const FitResult result =
        fitted(randomGarbage(random), options, kModes[random.integer(0, 3)]);
    usable += isUsable(result.status) ? 1 : 0;
  }
  EXPECT_GT(usable, kDraws / 20); // the sweep reaches the property
}

// The points' root mean square distance from their mean, for a cylinder across its
// axis.
double
spreadOf(const Sample& sample, const Patch& patch)
{
  const auto count = static_cast<double>(sample.points.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& q : sample.points)
    mean += q / count;
  const Eigen::Vector3d axis = patch.type.surface == SurfaceType::Sphere ?
                                   Eigen::Vector3d::Zero() :
                                   Eigen::Vector3d(patch.pose().R.col(0));
  double variance = 0.0;
  for (const Eigen::Vector3d& q : sample.points)
    variance += ((q - mean).squaredNorm() - std::pow(axis.dot(q - mean), 2)) / count;
  return std::sqrt(variance);
}

// However small the noise that is claimed.
TEST(FitDegenerate, ACentreOutOfReachIsFlagged)
{
  int near = 0, far = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(i);
    const bool sphere = random.integer(0, 1) == 0;
    const double size = randomMagnitude(random, -2.0, 1.0);
    const double radius = size * randomMagnitude(random, 0.5, 4.0);
    const double sigma = size * randomMagnitude(random, -9.0, -3.0);
    const Pose pose = test::randomPose(random);
    Sample sample;
    for (int k = 0; k < 50; ++k) {
      const double x = size * random.uniform(-0.5, 0.5);
      const double y = size * random.uniform(-0.5, 0.5);
      const double across = sphere ? x * x + y * y : y * y;
      const double z = -across / (radius + std::sqrt(radius * radius - across));
      sample.points.push_back(
          pose.toWorld(Eigen::Vector3d(x, y, z) + sigma * random.normalVector()));
      sample.covariances.push_back(isotropic(sigma));
    }
    sample.viewpoint = pose.toWorld({0.0, 0.0, 10.0 * size});
    FitOptions options = random.integer(0, 1) == 0 ? FitOptions{} : FitOptions::paper();
    options.surface =
        sphere ? SurfaceRequest::Sphere : SurfaceRequest::CircularCylinder;
    options.sigma_floor_m = 0.0;
    const FitResult result = fitted(sample, options);
    if (!isUsable(result.status))
      continue;
    const double spreads =
        1.0 / (std::abs(result.patch.kappa.x()) * spreadOf(sample, result.patch));
    if (spreads > 51.0) {
      EXPECT_TRUE(result.flags.curvature_not_observable) << spreads;
      ++far;
    }
    const double distance = (result.patch.c - sample.points.front()).norm() /
                            spreadOf(sample, result.patch);
    if (distance > 103.0) {
      EXPECT_TRUE(result.flags.curvature_not_observable) << distance;
    }
    near += spreads < 49.0 && !result.flags.curvature_not_observable ? 1 : 0;
  }
  EXPECT_GT(far, 100);
  EXPECT_GT(near, 100);
}

// ---- Misuse ------------------------------------------------------------------------

TEST(FitMisuse, OptionsThatMakeNoSenseThrow)
{
  using Change = void (*)(FitOptions&);
  const Change changes[] = {[](FitOptions& o) {
                              o.surface = SurfaceRequest::Sphere;
                              o.plane_boundary = BoundaryType::Circle;
                            },
                            [](FitOptions& o) { o.containment = 0.0; },
                            [](FitOptions& o) { o.containment = 1.0; },
                            [](FitOptions& o) { o.containment = 1e-300; },
                            [](FitOptions& o) { o.containment = 1.0 - 1e-16; },
                            [](FitOptions& o) { o.containment = kNan; },
                            [](FitOptions& o) { o.discrimination_level = 0.0; },
                            [](FitOptions& o) { o.discrimination_level = 1.0; },
                            [](FitOptions& o) { o.curvature_tolerance_per_m = -0.1; },
                            [](FitOptions& o) { o.curvature_tolerance_per_m = kNan; },
                            [](FitOptions& o) { o.max_curvature_per_m = 0.0; },
                            [](FitOptions& o) { o.max_curvature_per_m = kInfinity; },
                            [](FitOptions& o) { o.max_iterations = 0; },
                            [](FitOptions& o) { o.step_tolerance_sigma = 0.0; },
                            [](FitOptions& o) { o.polish_tolerance_sigma = -1.0; },
                            [](FitOptions& o) { o.sigma_floor_m = -1e-6; },
                            [](FitOptions& o) { o.sigma_floor_m = kNan; }};
  EXPECT_EQ(validityError(FitOptions{}), "");
  EXPECT_EQ(validityError(FitOptions::paper()), "");
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    FitOptions options;
    changes[i](options);
    EXPECT_NE(validityError(options), "") << i;
    EXPECT_THROW(PatchFitter{options}, std::invalid_argument) << i;
    EXPECT_THROW(PatchEstimator{options}, std::invalid_argument) << i;
  }
}

TEST(FitMisuse, AViewpointThatIsNotFiniteThrows)
{
  PointBatch batch;
  const Eigen::Vector3d nowhere(0.0, kNan, 0.0);
  EXPECT_THROW(batch.setViewpoint(nowhere), std::invalid_argument);
  EXPECT_THROW(batch.clear(Eigen::Vector3d::Zero(), nowhere), std::invalid_argument);
}

}} // namespace holdfast
