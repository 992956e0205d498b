// The paper's chain of stages: every Jacobian against finite differences of its stage,
// the whole chain against the patch it belongs to and against the exact covariance.
#include "support/finite_difference.h"
#include "support/patch_batch.h"
#include "support/random_patch.h"
#include "uncertainty/stagewise_stages.h"

#include "uncertainty/stagewise.h"
#include <holdfast/patch_estimator.h>

#include <Eigen/Geometry>

#include <array>

namespace holdfast { namespace {

using namespace stagewise;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using test::Random;
using test::Sample;

// ---- Jacobians ----

// Inputs below are of the order of 1, and so are the derivatives; differencing is right
// to some 1e-11 then.
constexpr double kJacobianTolerance = 1e-9;

template <typename F, int N>
void
expectJacobian(const char* name, const F& stage, const Vec<N>& x)
{
  const Eigen::MatrixXd expected = test::numericalJacobian(
      [&](const VectorXd& moved) -> VectorXd { return stage(Vec<N>(moved)).value; },
      x);
  EXPECT_LT(test::scaledError(stage(x).J, expected), kJacobianTolerance) << name;
}

template <int N>
Vec<N>
randomInput(Random& random)
{
  Vec<N> x;
  for (double& entry : x)
    entry = random.uniform(-0.8, 0.8);
  return x;
}

// Moments that points can have: positive variances, distinct in the plane.
Vec<5>
randomMoments(Random& random)
{
  const Eigen::Vector2d mean(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
  const double vx = random.uniform(1.0, 1.5), vy = random.uniform(0.3, 0.6);
  Vec<5> m;
  m << mean, vx + mean.x() * mean.x(), vy + mean.y() * mean.y(),
      random.uniform(-0.2, 0.2) + mean.x() * mean.y();
  return m;
}

template <int N>
Vec<N + 5>
withRandomMoments(Random& random)
{
  Vec<N + 5> x;
  x << randomMoments(random), randomInput<N>(random);
  return x;
}

Scatter
randomScatter(Random& random)
{
  const Matrix3d R = random.rotation();
  Scatter scatter;
  scatter.count = 20;
  scatter.mean = random.uniformVector(-0.5, 0.5);
  scatter.covariance = R * Vector3d(1.5, 0.8, 0.2).asDiagonal() * R.transpose();
  return scatter;
}

// (k, rest): a curvature well away from zero.
template <int N>
Vec<N>
withCurvature(Random& random, int position)
{
  Vec<N> x = randomInput<N>(random);
  x[position] = random.sign() * random.uniform(1.0, 2.0);
  return x;
}

constexpr int kCases = 10;

TEST(StageJacobian, Plane)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Pose pose{expMap(random.uniformVector(-0.8, 0.8)), random.unitVector()};
    expectJacobian(
        "theta of the plane",
        [&](const Vec<3>& x) { return planeFromTheta(pose, x); },
        Vec<3>(Vec<3>::Zero()));
    expectJacobian("eq. (3)", projectedCentre, randomInput<8>(random));
    expectJacobian("z of eqs. (3), (5)", normalVector, randomInput<2>(random));
    const Matrix3d C = randomScatter(random).covariance;
    Vec<6> entries;
    entries << C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2);
    expectJacobian(
        "normal of the scatter",
        [&](const Vec<6>& x) { return principalNormal(Vector3d(0.1, 0.2, 1.0), x); },
        entries);
  }
}

TEST(StageJacobian, UnboundedSurfaces)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Vector3d line = random.unitVector();
    Vec<6> paraboloid = Vec<6>::Zero();
    paraboloid.head<3>() = random.uniformVector(-1.0, 1.0);
    Vec<5> cylinder = Vec<5>::Zero();
    cylinder[0] = -1.5;
    expectJacobian(
        "theta of the paraboloid",
        [&](const Vec<6>& x) { return paraboloidFromTheta(line, x); },
        paraboloid);
    expectJacobian("theta of the sphere", sphereFromTheta, withCurvature<4>(random, 0));
    expectJacobian("eq. (4)", sphereApex, withCurvature<6>(random, 2));
    expectJacobian(
        "theta of the cylinder",
        [](const Vec<5>& x) { return cylinderFromTheta(-1.0, x); },
        cylinder);
    Vec<10> apex = withCurvature<10>(random, 6);
    apex.head<6>() << 0.2, 0.3, 1.0, 1.0, 0.1, -0.2;
    expectJacobian("eq. (5)", cylinderApex, apex);
  }
}

TEST(StageJacobian, Discrimination)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    Vec<9> x = randomInput<9>(random);
    x[0] += 2.0; // curvatures apart: the axes turn slowly
    expectJacobian("eq. (6)", planeFromParaboloid, x);
    expectJacobian("principal curvatures", principalCurvatures, x);
    expectJacobian("eq. (7)", cylindricCurvature, randomInput<8>(random));
    expectJacobian("eq. (8)", swappedAxes, randomInput<8>(random));
    expectJacobian("eq. (9)", circularFromParaboloid, x);
    // A half-turn about z composed with a small rotation lies at the edge of the
    // logarithm's range, |r| = pi; a larger one about x stays clear of it.
    Vec<8> clear = randomInput<8>(random);
    clear.segment<3>(2) << 1.5, 0.2, 0.9;
    expectJacobian("reversed axes", reversedAxes, clear);
  }
}

TEST(StageJacobian, MomentsByFrame)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Scatter scatter = randomScatter(random);
    expectJacobian(
        "eq. (10)",
        [&](const Vec<6>& x) { return moments(scatter, x); },
        randomInput<6>(random));
    expectJacobian(
        "eq. (11), revolute",
        [&](const Vec<6>& x) { return momentsAndSurface<1, 2>(scatter, x); },
        randomInput<6>(random));
    expectJacobian(
        "eq. (11)",
        [&](const Vec<8>& x) { return momentsAndSurface<2, 3>(scatter, x); },
        randomInput<8>(random));
  }
}

// Eq. (10) itself, points (x, y) one after the other.
VectorXd
momentsOfPoints(const VectorXd& xy)
{
  const Eigen::Map<const Eigen::Matrix2Xd> q(xy.data(), 2, xy.size() / 2);
  VectorXd m(5);
  m << q.rowwise().mean(), q.rowwise().squaredNorm() / double(q.cols()),
      q.row(0).dot(q.row(1)) / double(q.cols());
  return m;
}

TEST(StageJacobian, MomentsByPoints)
{
  Random random;
  VectorXd xy(14);
  for (double& entry : xy)
    entry = random.uniform(-1.0, 1.0);
  const Eigen::MatrixXd expected = test::numericalJacobian(momentsOfPoints, xy);
  for (int i = 0; i < 7; ++i)
    EXPECT_LT(test::scaledError(momentsByPoint(xy[2 * i], xy[2 * i + 1], 7),
                                expected.middleCols<2>(2 * i)),
              kJacobianTolerance);
}

TEST(StageJacobian, Bounds)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    expectJacobian(
        "eq. (12)",
        [](const Vec<12>& x) { return cylinderBound(1.96, x); },
        withRandomMoments<7>(random));
    for (const bool smooth : {true, false})
      expectJacobian(
          "eq. (13)",
          [=](const Vec<11>& x) { return circleBound(1.96, smooth, x); },
          withRandomMoments<6>(random));
    expectJacobian(
        "eq. (14)",
        [](const Vec<13>& x) { return ellipseBound(1.96, x); },
        withRandomMoments<8>(random));
    const Vec<10> m = withRandomMoments<5>(random);
    const auto axes = [](const Vec<10>& x) { return planeAxes(1.73, x); };
    expectJacobian("eq. (15)", axes, m);
    const Vec<10> x = axes(m).value;
    for (const bool smooth : {true, false})
      expectJacobian(
          "eq. (16)",
          [=](const Vec<10>& in) { return planeCircle(1.73, smooth, in); },
          x);
    expectJacobian(
        "eq. (17)",
        [](const Vec<10>& in) { return planeEllipse(false, in); },
        x);
    expectJacobian(
        "eq. (17), quad",
        [](const Vec<10>& in) { return planeQuad(false, in); },
        x);
  }
}

TEST(StageJacobian, ChangeOfFrame)
{
  for (int i = 0; i < kCases; ++i) {
    Random random(i);
    const Pose pose{expMap(random.uniformVector(-0.8, 0.8)), random.unitVector()};
    expectJacobian(
        "revolute",
        [&](const Vec<7>& x) { return movedPatch<2, 2>(pose, x); },
        randomInput<7>(random));
    expectJacobian(
        "with r",
        [&](const Vec<10>& x) { return movedPatch<4, 3>(pose, x); },
        randomInput<10>(random));
  }
}

// ---- The chain ----

class Stagewise : public testing::TestWithParam<PatchType> {};

struct Fitted {
  PointBatch batch;
  PatchFit fit;
  FitOptions options;
};

Fitted
fitted(const Sample& sample, FitOptions options)
{
  Fitted result{test::batchOf(sample), {}, options};
  result.fit = PatchFitter(result.options).fit(result.batch);
  return result;
}

// Every combination of the departures.
std::vector<FitOptions>
optionSets()
{
  std::vector<FitOptions> sets;
  for (int bits = 0; bits < 16; ++bits) {
    FitOptions options;
    options.debias_scatter = (bits & 1) != 0;
    options.normal_from_pca = (bits & 2) != 0;
    options.smooth_circle_radius = (bits & 4) != 0;
    options.residual = (bits & 8) != 0 ? Residual::Ray : Residual::Sampson;
    options.centre_on_normal_line = false; // the paper's chain ends at the apex
    sets.push_back(options);
  }
  return sets;
}

void
expectSound(const Fitted& fitted)
{
  ASSERT_EQ(fitted.fit.status, FitStatus::Converged) << statusName(fitted.fit.status);
  const ChainResult chain = runChain(fitted.fit, fitted.batch, fitted.options);
  // A few dozen operations on numbers of the order of 1; angles lose some digits where
  // curvatures or moments are close.
  EXPECT_LT((chain.mean - pack(fitted.fit.bounded.patch)).cwiseAbs().maxCoeff(), 1e-9);
  const ParameterMatrix S =
      stagewiseCovariance(fitted.fit, fitted.batch, fitted.options);
  EXPECT_TRUE(S.allFinite());
  EXPECT_EQ(S, S.transpose());
  EXPECT_TRUE(isPositiveSemiDefinite(S, 1e-12));
}

// The chain passes through the fit's own patch: same frame, same order and sense of the
// axes, same bounds.
TEST_P(Stagewise, EndsAtThePatch)
{
  for (const FitOptions& options : optionSets())
    for (int view = 0; view < 4; ++view) {
      Random random(view);
      const Sample sample = transformed(test::robotSample(GetParam(), 1.0, random),
                                        test::randomPose(random));
      expectSound(fitted(sample, test::optionsFor(GetParam(), options)));
    }
}

// ---- Beside the exact covariance ----

// To the tangent space, c in the axes of the patch.
ParameterMatrix
inPatchAxes(const Patch& patch, const ParameterMatrix& S)
{
  ParameterMatrix J = tangentJacobian(patch);
  const int c = layoutOf(patch.type).c();
  J.block<3, 3>(c, c) = expMap(patch.r).transpose();
  return J * S * J.transpose();
}

// Standard deviations by the chain over those of the exact covariance.
VectorXd
sigmaRatios(const Sample& sample, const FitOptions& options)
{
  const Fitted chain = fitted(sample, options);
  const Patch& patch = chain.fit.bounded.patch;
  PointBatch batch = test::batchOf(sample);
  const FitResult exact = estimatePatch(batch, chain.options);
  const ParameterMatrix S =
      inPatchAxes(patch, stagewiseCovariance(chain.fit, chain.batch, chain.options));
  return (S.diagonal().array() /
          inPatchAxes(patch, exact.covariance).diagonal().array())
      .sqrt();
}

enum class Expected { Same, RightMagnitude, TooSmall, TooLarge };

// What is expected of parameter i. The centre across the normal is where the paper's
// assumptions fail:
//   - a paraboloid's is the centroid's, which counts as known (I-2);
//   - a sphere's or cylinder's apex c = C - z/k stays over the points: C and z swing
//     together, which the independence of eqs. (4) and (5) forgets. Its bound d, taken
//     about c, suffers too.
// II-6 takes c along the axis from the points and mends both in that direction.
Expected
expectedOf(PatchType type, int i)
{
  if (type.surface == SurfaceType::Plane)
    return Expected::Same;
  const int c = layoutOf(type).c();
  const int first_across = type.boundary == BoundaryType::Rectangle ? c + 1 : c;
  if (i < first_across || i > c + 1)
    return Expected::RightMagnitude;
  return isParaboloid(type.surface) ? Expected::TooSmall : Expected::TooLarge;
}

// Robot scenes from 1 m, defaults, 200 views at tilts of 0.2-0.8 rad; mean (smallest
// to largest) of the ratios, delta and c in the axes of the patch:
//
//             d, gamma              kappa             delta             c_z
//   elliptic  0.95 (0.88-1.07)  0.99 (0.96-1.01)  0.92 (0.82-1.01)  0.99 (0.97-1.00)
//   hyperb.   0.99 (0.95-1.07)  1.00 (0.96-1.02)  1.01 (0.97-1.06)  1.00 (0.98-1.01)
//   cylindric 0.97 (0.89-1.02)  0.99 (0.96-1.00)  0.97 (0.88-1.01)  1.00 (0.96-1.01)
//   circular  0.93 (0.90-0.97)  0.99 (0.96-1.00)  0.86 (0.83-0.90)  0.99 (0.96-1.00)
//   planes    1.00 (1.00-1.00)         -          1.00 (1.00-1.00)  1.00 (1.00-1.00)
//   sphere    1.28 (1.16-1.35)  0.99 (0.94-1.04)  1.00 (1.00-1.00)  1.00 (0.96-1.03)
//   cylinder  1.13 (0.98-1.43)  1.00 (0.96-1.03)  1.00 (0.97-1.03)  1.00 (0.98-1.01)
//
//             c_x                   c_y
//   elliptic  0.08 (0.00-0.14)  0.10 (0.00-0.18)
//   hyperb.   0.03 (0.00-0.12)  0.05 (0.00-0.20)
//   cylindric 0.92 (0.84-0.97)  0.14 (0.01-0.23)
//   circular  0.10 (0.00-0.19)  0.10 (0.00-0.18)
//   planes    1.00 (1.00-1.00)  1.00 (1.00-1.00)
//   sphere    3.98 (2.15-5.74)  3.98 (2.29-5.82)
//   cylinder  0.95 (0.88-1.00)  5.31 (2.49-8.38)
//
// The paper's options give the same within 0.02, but for d of sphere (1.05) and
// cylinder (1.05). The tolerances leave room for views not among the 200.
TEST_P(Stagewise, SigmasAreOfTheRightMagnitude)
{
  for (const FitOptions& options : {FitOptions{}, FitOptions::paper()})
    for (int view = 0; view < 20; ++view) {
      Random random(view);
      const ReferenceScene scene = robotScene(GetParam(),
                                              1.0,
                                              random.uniform(0.2, 0.8),
                                              random.uniform(0.0, 6.28));
      const VectorXd ratio = sigmaRatios(test::sampleScene(scene, 1.0, random.engine()),
                                         test::optionsFor(GetParam(), options));
      for (int i = 0; i < ratio.size(); ++i) {
        SCOPED_TRACE(parameterNames(GetParam())[static_cast<std::size_t>(i)]);
        const auto [low, high] = [&]() -> std::array<double, 2> {
          switch (expectedOf(GetParam(), i)) {
          case Expected::Same:
            return {0.98, 1.02};
          case Expected::TooSmall:
            return {0.0, 0.5};
          case Expected::TooLarge:
            return {1.5, 12.0};
          case Expected::RightMagnitude:
            break;
          }
          return {0.5, 2.0};
        }();
        EXPECT_GE(ratio[i], low);
        EXPECT_LE(ratio[i], high);
      }
    }
}

// ---- Invariance and degenerate data ----

// [d | k | c] of a patch seen from another frame; its rotation may be written
// differently.
TEST_P(Stagewise, RotatesWithTheCloud)
{
  Random random;
  const Sample sample = test::robotSample(GetParam(), 1.0, random);
  const Pose T = test::randomPose(random);
  FitOptions options = test::optionsFor(GetParam());
  options.polish_tolerance_sigma = 1e-10;
  const Fitted a = fitted(sample, options), b = fitted(transformed(sample, T), options);
  ASSERT_EQ(a.fit.status, FitStatus::Converged);
  ASSERT_EQ(b.fit.status, FitStatus::Converged);
  const ParameterLayout layout = layoutOf(GetParam());
  ParameterMatrix select = ParameterMatrix::Zero(layout.r() + 3, layout.size());
  select.topLeftCorner(layout.r(), layout.r()).setIdentity();
  ParameterMatrix turn = select;
  select.bottomRightCorner<3, 3>().setIdentity();
  turn.bottomRightCorner<3, 3>() = T.R;
  const ParameterMatrix expected =
      propagate(turn, stagewiseCovariance(a.fit, a.batch, a.options));
  const ParameterMatrix actual =
      propagate(select, stagewiseCovariance(b.fit, b.batch, b.options));
  // Coordinates of a few metres round to 1e-15 of sigmas of 1e-5, and the fits stop
  // within 1e-10 sigma.
  EXPECT_LT(test::normalizedDifference(actual, expected), 1e-7);
}

// A symmetric grid over z = 1 + h r^2 seen from the origin: the normal is exactly -z,
// where r_xy has no derivative, and no direction is a principal axis.
Sample
symmetricBowl(double h)
{
  Sample sample;
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j) {
      const double x = 0.02 * i, y = 0.02 * j;
      sample.points.emplace_back(x, y, 1.0 + h * (x * x + y * y));
      sample.covariances.emplace_back(1e-6 * Matrix3d::Identity());
    }
  return sample;
}

TEST(StagewiseDegenerate, AxesThatCannotBeTold)
{
  for (const SurfaceRequest request : {SurfaceRequest::Plane,
                                       SurfaceRequest::EllipticParaboloid,
                                       SurfaceRequest::CylindricParaboloid}) {
    FitOptions options;
    options.surface = request;
    const Fitted bowl =
        fitted(symmetricBowl(request == SurfaceRequest::Plane ? 0.0 : 2.0), options);
    ASSERT_EQ(bowl.fit.status, FitStatus::Converged);
    const ParameterMatrix S = stagewiseCovariance(bowl.fit, bowl.batch, bowl.options);
    EXPECT_TRUE(S.allFinite());
    EXPECT_TRUE(isPositiveSemiDefinite(S, 1e-12));
    // Turned about z by more than a full circle, when one sigma is so large.
    const int z = layoutOf(bowl.fit.bounded.patch.type).r() + 2;
    EXPECT_GT(toTangent(bowl.fit.bounded.patch, S)(z, z), 1.0);
  }
}

// The data call it a plane: eq. (6) leads to stage II-9.
TEST(StagewiseDegenerate, PlaneFromAParaboloid)
{
  for (const PatchType type : {kPatchTypes[4], kPatchTypes[5], kPatchTypes[7]}) {
    Random random;
    FitOptions options;
    options.plane_boundary = type.boundary;
    const Fitted plane = fitted(test::robotSample(type, 0.5, random), options);
    ASSERT_EQ(plane.fit.bounded.patch.type.surface, SurfaceType::Plane);
    ASSERT_EQ(plane.fit.surface.surface.model, kernel::Model::Paraboloid);
    expectSound(plane);
  }
}

TEST(StagewiseDegenerate, NoCovarianceWithoutAFit)
{
  Sample three = symmetricBowl(2.0);
  three.points.resize(3);
  three.covariances.resize(3);
  const Fitted none = fitted(three, {});
  ASSERT_EQ(none.fit.status, FitStatus::TooFewPoints);
  EXPECT_EQ(stagewiseCovariance(none.fit, none.batch, none.options).size(), 0);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Stagewise,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
