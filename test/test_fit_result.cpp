// What a FitResult says about its own uncertainty, against patches drawn from it.
#include "support/random_patch.h"

#include <holdfast/fit/result.h>

#include <cmath>

namespace holdfast { namespace {

using test::Random;
using test::randomPatch;

constexpr std::uint64_t kCases = 5;
constexpr int kDraws = 4000;

/// Of the rms of kDraws numbers whose squares are at worst chi-square with one degree
/// of freedom: 1/sqrt(2 kDraws) = 1.1 %, five times.
constexpr double kTolerance = 0.056;

class SigmasOf : public testing::TestWithParam<PatchType> {};

/// A usable fit with a covariance of about 1 mrad and 1 mm, whose root goes to `root`.
FitResult
randomFit(Random& random, PatchType type, ParameterMatrix& root)
{
  FitResult fit;
  fit.status = FitStatus::Converged;
  fit.patch = randomPatch(random, type);
  const int size = layoutOf(type).size();
  root = ParameterMatrix(size, size);
  for (int i = 0; i < size * size; ++i)
    root(i / size, i % size) = 1e-3 * random.normal() / std::sqrt(size);
  fit.covariance = root * root.transpose();
  return fit;
}

TEST_P(SigmasOf, AreTheSpreadOfPatchesDrawnFromTheCovariance)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    ParameterMatrix root;
    const FitResult fit = randomFit(random, GetParam(), root);
    const Eigen::Vector3d direction = random.normalVector();
    double turned = 0.0, moved = 0.0, along = 0.0;
    for (int draw = 0; draw < kDraws; ++draw) {
      ParameterVector step(root.rows());
      for (Eigen::Index k = 0; k < step.size(); ++k)
        step[k] = random.normal();
      const Patch patch = unpack(fit.patch.type, pack(fit.patch) + root * step);
      const Eigen::Vector3d shift = patch.c - fit.patch.c;
      turned += fit.patch.normal().cross(patch.normal()).squaredNorm() / kDraws;
      moved += shift.squaredNorm() / kDraws;
      along += std::pow(shift.dot(direction.normalized()), 2) / kDraws;
    }
    EXPECT_NEAR(normalSigma(fit) / std::sqrt(turned), 1.0, kTolerance);
    EXPECT_NEAR(centreSigma(fit) / std::sqrt(moved), 1.0, kTolerance);
    EXPECT_NEAR(centreSigma(fit, direction) / std::sqrt(along), 1.0, kTolerance);
  }
}

INSTANTIATE_TEST_SUITE_P(All,
                         SigmasOf,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

TEST(FitResult, HasNoSigmasWithoutACovariance)
{
  Random random;
  ParameterMatrix root;
  const PatchType type{SurfaceType::Sphere, BoundaryType::Circle};
  const FitResult usable = randomFit(random, type, root);
  FitResult failed = usable, empty = usable;
  failed.status = FitStatus::Degenerate;
  empty.covariance.resize(0, 0);
  for (const FitResult& fit : {FitResult(), failed, empty}) {
    EXPECT_TRUE(std::isnan(normalSigma(fit)));
    EXPECT_TRUE(std::isnan(centreSigma(fit)));
    EXPECT_TRUE(std::isnan(centreSigma(fit, Eigen::Vector3d::UnitZ())));
  }
  EXPECT_FALSE(std::isnan(normalSigma(usable)));
}

TEST(FitResult, DividesChiSquareByItsDegreesOfFreedom)
{
  FitResult fit;
  fit.chi2 = 30.0;
  EXPECT_EQ(chi2PerDof(fit), 0.0);
  fit.chi2_dof = 20;
  EXPECT_EQ(chi2PerDof(fit), 1.5);
}

}} // namespace holdfast
