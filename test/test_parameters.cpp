#include "support/finite_difference.h"
#include "support/random_patch.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/patch/surface.h>

#include <cmath>
#include <limits>
#include <set>

namespace holdfast { namespace {

using test::numericalJacobian;
using test::Random;
using test::randomPatch;
using test::randomPose;
using test::scaledError;

constexpr std::uint64_t kCases = 30;

// A few rotations of coordinates of a few metres.
constexpr double kRounding = 1e-13;

class Parameters : public testing::TestWithParam<PatchType> {};

// The same set of points: f agrees everywhere and so do the bounds.
void
expectSamePatch(const Patch& a, const Patch& b, Random& random)
{
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d q = a.c + random.uniformVector(-0.2, 0.2);
    EXPECT_NEAR(implicitValue(a, q), implicitValue(b, q), kRounding);
    const Eigen::Vector2d in_a = a.pose().toLocal(q).head<2>();
    const Eigen::Vector2d in_b = b.pose().toLocal(q).head<2>();
    EXPECT_EQ(contains(a, in_a), contains(b, in_b));
  }
}

// The patch in axes turned about its normal, which may describe the same point set only
// if the caller turns bounds and curvatures along.
Patch
turnedAboutNormal(Patch patch, double angle)
{
  patch.r = logMap(patch.pose().R * expMap({0.0, 0.0, angle}));
  return patch;
}

Patch
halfTurned(const Patch& patch)
{
  Patch turned = turnedAboutNormal(patch, kPi);
  if (patch.type.boundary == BoundaryType::Quad) {
    std::swap(turned.d(0), turned.d(2));
    std::swap(turned.d(1), turned.d(3));
  }
  return turned;
}

TEST_P(Parameters, NamesAreOnePerParameterAndDistinct)
{
  const std::vector<std::string> names = parameterNames(GetParam());
  EXPECT_EQ(static_cast<int>(names.size()), degreesOfFreedom(GetParam()));
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  const ParameterLayout layout = layoutOf(GetParam());
  EXPECT_EQ(layout.size(), degreesOfFreedom(GetParam()));
  EXPECT_EQ(names[static_cast<std::size_t>(layout.r())], "r_x");
  EXPECT_EQ(names[static_cast<std::size_t>(layout.c())], "c_x");
}

TEST_P(Parameters, UnpackInvertsPack)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Patch back = unpack(GetParam(), pack(patch));
    EXPECT_EQ(back.type, patch.type);
    EXPECT_EQ(back.d, patch.d);
    EXPECT_EQ(back.kappa, patch.kappa);
    EXPECT_EQ(back.r, patch.r);
    EXPECT_EQ(back.c, patch.c);
  }
}

TEST_P(Parameters, UnpackRefusesTheWrongLength)
{
  const int n = degreesOfFreedom(GetParam());
  EXPECT_THROW(unpack(GetParam(), ParameterVector::Zero(n - 1)), std::invalid_argument);
  EXPECT_THROW(unpack(GetParam(), ParameterVector()), std::invalid_argument);
}

TEST_P(Parameters, RandomPatchesAreValid)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    EXPECT_EQ(validityError(randomPatch(random, GetParam())), "");
  }
}

TEST_P(Parameters, NonFiniteNumbersAreInvalid)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  const ParameterVector parameters = pack(patch);
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()}) {
      ParameterVector changed = parameters;
      changed(i) = bad;
      EXPECT_NE(validityError(unpack(GetParam(), changed)), "");
    }
  }
}

TEST_P(Parameters, BoundsThatAreNotPositiveAreInvalid)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  for (int i = 0; i < boundaryParameterCount(GetParam().boundary); ++i) {
    for (const double bad : {0.0, -0.1}) {
      Patch changed = patch;
      changed.d(i) = bad;
      EXPECT_NE(validityError(changed), "");
    }
  }
}

TEST_P(Parameters, CanonicalFormHoldsItsPromises)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    Patch patch = randomPatch(random, GetParam());
    patch = turnedAboutNormal(patch, random.uniform(-kPi, kPi));
    const Patch result = canonical(patch);
    EXPECT_EQ(validityError(result), "");
    EXPECT_LT((result.normal() - patch.normal()).norm(), kRounding);
    EXPECT_EQ(result.c, patch.c);
    if (isRevolute(GetParam()))
      continue;
    EXPECT_GE(result.pose().R(0, 0), -1e-12);
    expectSamePatch(result, patch, random);
    if (curvatureParameterCount(GetParam().surface) == 2) {
      EXPECT_LE(std::abs(result.kappa.x()), std::abs(result.kappa.y()));
    }
  }
}

TEST_P(Parameters, CanonicalFormIsItsOwn)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    EXPECT_LT((pack(canonical(patch)) - pack(patch)).norm(), kRounding);
  }
}

TEST_P(Parameters, CanonicalFormForgetsTheHalfTurn)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    EXPECT_LT((pack(canonical(halfTurned(patch))) - pack(patch)).norm(), kRounding);
  }
}

TEST_P(Parameters, CanonicalFormForgetsTheOrderOfTheAxes)
{
  if (curvatureParameterCount(GetParam().surface) != 2)
    return; // nothing else orders the axes
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    for (const double angle : {kPi / 2, -kPi / 2}) {
      Patch swapped = turnedAboutNormal(patch, angle);
      std::swap(swapped.d(0), swapped.d(1));
      std::swap(swapped.kappa.x(), swapped.kappa.y());
      EXPECT_LT((pack(canonical(swapped)) - pack(patch)).norm(), kRounding);
    }
  }
}

TEST_P(Parameters, CanonicalFormShortensTheRotation)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    Patch longer = patch;
    longer.r *= (patch.r.norm() + 2.0 * kPi) / patch.r.norm();
    EXPECT_NE(validityError(longer), "");
    EXPECT_LT((pack(canonical(longer)) - pack(patch)).norm(), 4 * kRounding);
  }
}

TEST_P(Parameters, CanonicalFormHasOneSignAtPi)
{
  Random random;
  Patch patch = randomPatch(random, GetParam());
  // A half turn about an axis in the xy plane: z points down, x stays to the front.
  patch.r = {kPi * std::cos(0.3), kPi * std::sin(0.3), 0.0};
  Patch other = patch;
  other.r = -patch.r;
  const ParameterVector a = pack(canonical(patch));
  EXPECT_LT((a - pack(canonical(other))).norm(), kRounding);
  EXPECT_GT(a(layoutOf(GetParam()).r()), 0.0);
}

TEST_P(Parameters, AxisAcrossWorldXDecidesByY)
{
  if (isRevolute(GetParam()))
    return; // no x axis
  Random random;
  Patch patch = randomPatch(random, GetParam());
  Eigen::Matrix3d R;
  // x axis along -y, off it by less than rounding either way; then along -z.
  for (const double tilt : {-1e-14, 0.0, 1e-14}) {
    R << tilt, 1, 0, -1, tilt, 0, 0, 0, 1;
    patch.r = logMap(R);
    EXPECT_GT(canonical(patch).pose().R(1, 0), 0.9);
    R << tilt, 0, 1, 0, 1, 0, -1, 0, tilt;
    patch.r = logMap(R);
    EXPECT_GT(canonical(patch).pose().R(2, 0), 0.9);
  }
}

TEST_P(Parameters, TransformedPatchIsTheSamePointsMoved)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Patch patch = randomPatch(random, GetParam());
    const Pose T = randomPose(random);
    const Patch moved = transformed(patch, T);
    EXPECT_EQ(validityError(moved), "");
    EXPECT_LT((moved.c - T.toWorld(patch.c)).norm(), kRounding);
    EXPECT_LT((moved.normal() - T.R * patch.normal()).norm(), kRounding);
    for (int k = 0; k < 10; ++k) {
      const Eigen::Vector3d q = patch.c + random.uniformVector(-0.2, 0.2);
      EXPECT_NEAR(implicitValue(moved, T.toWorld(q)), implicitValue(patch, q), 1e-13);
    }
    EXPECT_LT((pack(transformed(moved, T.inverse())) - pack(patch)).norm(), 1e-12);
  }
}

TEST_P(Parameters, TangentJacobianIsTheDerivative)
{
  const ParameterLayout layout = layoutOf(GetParam());
  for (const double angle : {0.0, 1e-8, 1e-4, 1.0, 3.0, kPi - 1e-8}) {
    Random random(static_cast<std::uint64_t>(1e8 * angle));
    Patch patch = randomPatch(random, GetParam());
    patch.r = layout.r_count == 2 ? Eigen::Vector3d(0.6, -0.8, 0) : random.unitVector();
    patch.r *= angle;
    const Eigen::Matrix3d R = patch.pose().R;
    const auto tangent = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      const Patch moved = unpack(GetParam(), x);
      Eigen::VectorXd result = x;
      const Eigen::Vector3d delta = logMap(R.transpose() * moved.pose().R);
      result.segment(layout.r(), layout.r_count) = delta.head(layout.r_count);
      return result;
    };
    // Error of the differences: see numericalJacobian().
    EXPECT_LT(scaledError(tangentJacobian(patch),
                          numericalJacobian(tangent, Eigen::VectorXd(pack(patch)))),
              1e-11);
  }
}

TEST_P(Parameters, CovarianceTurnsIntoTheTangentSpace)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  const ParameterMatrix J = tangentJacobian(patch);
  const ParameterMatrix Sigma = J.transpose() * J;
  EXPECT_LT((toTangent(patch, Sigma) - J * Sigma * J.transpose()).norm(), kRounding);
  EXPECT_THROW(toTangent(patch, ParameterMatrix::Identity(3, 3)),
               std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Parameters,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

TEST(ParameterNames, AreThoseOfTheResults)
{
  EXPECT_EQ(parameterNames({SurfaceType::EllipticParaboloid, BoundaryType::Ellipse}),
            (std::vector<std::string>{"d_x",
                                      "d_y",
                                      "kappa_x",
                                      "kappa_y",
                                      "r_x",
                                      "r_y",
                                      "r_z",
                                      "c_x",
                                      "c_y",
                                      "c_z"}));
  EXPECT_EQ(
      parameterNames({SurfaceType::Sphere, BoundaryType::Circle}),
      (std::vector<std::string>{"d", "kappa", "r_x", "r_y", "c_x", "c_y", "c_z"}));
  EXPECT_EQ(parameterNames({SurfaceType::Plane, BoundaryType::Quad}),
            (std::vector<std::string>{"d_1",
                                      "d_2",
                                      "d_3",
                                      "d_4",
                                      "gamma",
                                      "r_x",
                                      "r_y",
                                      "r_z",
                                      "c_x",
                                      "c_y",
                                      "c_z"}));
}

TEST(ParameterNames, IllegalPairsAreMisuse)
{
  const PatchType illegal{SurfaceType::Sphere, BoundaryType::Quad};
  EXPECT_THROW(layoutOf(illegal), std::invalid_argument);
  EXPECT_THROW(parameterNames(illegal), std::invalid_argument);
  EXPECT_THROW(unpack(illegal, ParameterVector::Zero(11)), std::invalid_argument);
}

// One change that makes the patch invalid and a word its message must contain.
void
expectInvalid(const Patch& patch, const std::string& word)
{
  EXPECT_NE(validityError(patch).find(word), std::string::npos) << validityError(patch);
}

TEST(Validity, MessagesNameWhatIsWrong)
{
  Random random;
  Patch patch = randomPatch(random, {SurfaceType::Sphere, BoundaryType::Circle});
  patch.type.boundary = BoundaryType::Quad;
  expectInvalid(patch, "sphere cannot be bounded by a quad");
  patch = randomPatch(random, {SurfaceType::Sphere, BoundaryType::Circle});
  patch.r.z() = 0.1;
  expectInvalid(patch, "r_z");
  patch.r = {0.0, 4.0, 0.0};
  expectInvalid(patch, "pi");
  patch = randomPatch(random, {SurfaceType::Plane, BoundaryType::Quad});
  patch.d(4) = 0.5 * kPi;
  expectInvalid(patch, "gamma");
  patch = randomPatch(random, {SurfaceType::Plane, BoundaryType::Circle});
  patch.d(1) = 0.1;
  expectInvalid(patch, "does not use");
}

TEST(Validity, CurvaturesMustAgreeWithTheSurface)
{
  Random random;
  Patch patch =
      randomPatch(random, {SurfaceType::EllipticParaboloid, BoundaryType::Ellipse});
  patch.kappa.x() *= -1.0;
  expectInvalid(patch, "same sign");
  patch =
      randomPatch(random, {SurfaceType::HyperbolicParaboloid, BoundaryType::Ellipse});
  patch.kappa.x() *= -1.0;
  expectInvalid(patch, "opposite signs");
  patch.kappa.x() = 0.0;
  expectInvalid(patch, "other than zero");
  patch = randomPatch(random, {SurfaceType::Plane, BoundaryType::Ellipse});
  patch.kappa.x() = 1.0;
  expectInvalid(patch, "does not use");
  patch = randomPatch(random, {SurfaceType::Sphere, BoundaryType::Circle});
  patch.kappa.y() = patch.kappa.x();
  expectInvalid(patch, "does not use");
}

}} // namespace holdfast
