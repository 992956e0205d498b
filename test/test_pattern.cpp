// Errors that points share: the sums over cells against those over all pairs.
#include "support/kinect_pattern.h"
#include "support/patch_batch.h"
#include "support/random.h"

#include "fit/fit_patch.h"
#include "fit/pattern.h"
#include "fit/surface_fit.h"
#include "geometry/symmetric.h"
#include "uncertainty/covariance.h"

#include <holdfast/patch_estimator.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace holdfast { namespace {

using test::kinectPattern, test::Random;

constexpr double kFocal = 525.0;

// Pixels of a disc on a surface z = kappa r^2 / 2 about a point of a tilted plane, or
// on one that bends in one direction only.
PointBatch
disc(double radius_px,
     int stride,
     double kappa,
     double tilt,
     const NoisePattern& pattern,
     double white_px = 0.05,
     bool bends_once = false)
{
  StereoNoiseModel::Parameters parameters;
  parameters.sigma_point_px = 0.0;
  parameters.sigma_disparity_px = std::sqrt(pattern.variance() + white_px * white_px);
  const StereoNoiseModel noise(parameters);
  const Eigen::Vector3d centre(0.1, -0.05, 1.0);
  const Eigen::Vector3d normal(std::sin(tilt), 0.0, -std::cos(tilt));
  PointBatch batch;
  batch.clear(centre);
  const double cu = kFocal * centre.x() / centre.z(),
               cv = kFocal * centre.y() / centre.z();
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> directions;
  const int reach = static_cast<int>(radius_px);
  for (int i = -reach; i <= reach; i += stride)
    for (int j = -reach; j <= reach; j += stride) {
      if (std::hypot(i, j) > radius_px)
        continue;
      const Eigen::Vector2d pixel(cu + i, cv + j);
      const Eigen::Vector3d ray(pixel.x() / kFocal, pixel.y() / kFocal, 1.0);
      Eigen::Vector3d q = ray * (normal.dot(centre) / normal.dot(ray));
      const Eigen::Vector3d beside(q.x() - centre.x(), 0.0, q.z() - centre.z());
      q += 0.5 * kappa * (bends_once ? beside : q - centre).squaredNorm() * normal;
      batch.add(q, noise.covariance(q));
      pixels.push_back(pixel);
      directions.push_back(noise.patternDirection(q));
    }
  batch.setPattern(std::make_shared<const CorrelatedNoise>(pattern));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    batch.channel(PointBatch::U)[i] = pixels[i].x();
    batch.channel(PointBatch::V)[i] = pixels[i].y();
    for (int k = 0; k < 3; ++k)
      batch.channel(PointBatch::EX + k == PointBatch::EX ? PointBatch::EX :
                    k == 1                               ? PointBatch::EY :
                             PointBatch::EZ)[i] = directions[i][k];
  }
  return batch;
}

// Covariance of gradient and moments by the sum over all pairs of points.
struct PairSums {
  Eigen::MatrixXd white, shared;
};

PairSums
overAllPairs(const PatchFit& fit, const PointBatch& batch, const FitOptions& options)
{
  const UnboundedSurface& surface = fit.surface.surface;
  const int p = kernel::parameterCount(surface.model);
  const int n = batch.size();
  std::vector<double> X;
  kernel::crossTerms(surface.model,
                     options.residual,
                     kernelPoints(batch),
                     kernelState(surface, fit.scatter),
                     X);
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(kPatternTerms, n);
  Eigen::MatrixXd white = Eigen::MatrixXd::Zero(kPatternTerms, kPatternTerms);
  const double shared = batch.pattern()->pattern().variance();
  for (int i = 0; i < n; ++i) {
    Eigen::Matrix<double, kPatternTerms, 3> U =
        Eigen::Matrix<double, kPatternTerms, 3>::Zero();
    U.topRows(p) =
        Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
            X.data() + 3 * p * i,
            p,
            3);
    const Eigen::Vector3d qt =
        surface.R.transpose() * (batch.point(i) - batch.origin() - fit.scatter.mean);
    U.middleRows<3>(6) = Eigen::Matrix3d::Identity() / n;
    for (int e = 0; e < 6; ++e) {
      const int b = symmetric::kRow[e], c = symmetric::kColumn[e];
      U(9 + e, c) += qt[b] / n;
      U(9 + e, b) += qt[c] / n;
    }
    const Eigen::Vector3d r =
        surface.R.transpose() * Eigen::Vector3d(batch.channel(PointBatch::EX)[i],
                                                batch.channel(PointBatch::EY)[i],
                                                batch.channel(PointBatch::EZ)[i]);
    Y.col(i) = U * r;
    const Eigen::Matrix3d S = surface.R.transpose() * batch.covariance(i) * surface.R;
    white += U * (S - shared * r * r.transpose()) * U.transpose();
  }
  Eigen::MatrixXd C(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      C(i, j) = batch.pattern()->pattern().covariance(std::hypot(
          batch.channel(PointBatch::U)[i] - batch.channel(PointBatch::U)[j],
          batch.channel(PointBatch::V)[i] - batch.channel(PointBatch::V)[j]));
  return {white, Y * C * Y.transpose()};
}

Eigen::MatrixXd
overCells(const Linearization& l)
{
  Eigen::MatrixXd sum = l.pattern;
  sum.topLeftCorner<6, 6>() += l.XX;
  sum.topRightCorner<6, 9>() += l.XD;
  sum.bottomLeftCorner<9, 6>() += l.XD.transpose();
  sum.bottomRightCorner<9, 9>() += l.DD;
  return sum;
}

// d[theta | moments] / d[gradient | moments].
Eigen::MatrixXd
jacobian(const Linearization& l)
{
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(l.H).inverse();
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(kPatternTerms, kPatternTerms);
  J.topLeftCorner(6, 6) = -inverse;
  J.topRightCorner(6, 9) = -inverse * l.A;
  return J;
}

struct Comparison {
  double nees; // over dof, of theta, where `overAllPairs` is the truth
  double offset; // ratios of variances
  double tilt;
};

Comparison
compare(PointBatch& batch)
{
  FitOptions options;
  options.surface = SurfaceRequest::Paraboloid;
  const PatchFit fit = PatchFitter(options).fit(batch);
  EXPECT_EQ(fit.surface.status, FitStatus::Converged);
  const Linearization& l = fit.surface.linearization;
  const Eigen::MatrixXd J = jacobian(l);
  const PairSums sums = overAllPairs(fit, batch, options);
  const Eigen::MatrixXd pairs =
      (J * (sums.white + sums.shared) * J.transpose()).topLeftCorner(6, 6);
  const Eigen::MatrixXd cells = (J * overCells(l) * J.transpose()).topLeftCorner(6, 6);
  const Eigen::VectorXd scale = pairs.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd a = scale.asDiagonal() * cells * scale.asDiagonal();
  const Eigen::MatrixXd b = scale.asDiagonal() * pairs * scale.asDiagonal();
  return {a.ldlt().solve(b).trace() / 6.0, a(5, 5), a(3, 3)};
}

// Radii of 3 to 10 cm at 1 m, and the recordings' 8 to 35 px. The cells cost up to a
// seventh of the NEES in single patches (a fifth of one variance; of four hundred
// others a sixth and a quarter at most), where a row of pixels falls on another side of
// a line between cells, and next to nothing in the mean.
TEST(Pattern, OverCellsIsNearTheSumOverAllPairs)
{
  Random random;
  constexpr int kPatches = 40;
  double nees = 0.0;
  for (int patch = 0; patch < kPatches; ++patch) {
    const double radius = random.uniform(10.0, 52.0);
    const int stride =
        std::max(1, static_cast<int>(radius * random.uniform(0.05, 0.22)));
    NoisePattern pattern = kinectPattern();
    if (patch % 2 == 1)
      pattern = {{{0.089, 2.1, PatternShape::Exponential},
                  {0.103, 79.0, PatternShape::Exponential}}};
    const double tilt = random.uniform(0.0, 1.0);
    PointBatch batch = disc(radius, stride, random.uniform(-4.0, 4.0), tilt, pattern);
    const Comparison found = compare(batch);
    EXPECT_NEAR(found.nees, 1.0, 0.15) << radius << " px, stride " << stride;
    EXPECT_NEAR(found.offset, 1.0, 0.2) << radius << " px, stride " << stride;
    EXPECT_NEAR(found.tilt, 1.0, 0.2) << radius << " px, stride " << stride;
    nees += found.nees / kPatches;
  }
  EXPECT_NEAR(nees, 1.0, 0.03);
}

// White errors are summed point by point: both sums are the same but for rounding.
TEST(Pattern, CanBeToldFromWhiteErrors)
{
  Random random;
  for (int patch = 0; patch < 10; ++patch) {
    const double radius = random.uniform(10.0, 30.0);
    const double curvature = random.uniform(-4.0, 4.0);
    PointBatch batch =
        disc(radius, 2, curvature, random.uniform(0.0, 1.0), kinectPattern());
    FitOptions options;
    options.surface = SurfaceRequest::Paraboloid;
    options.separate_pattern = true;
    options.polish_tolerance_sigma = 1e-9; // as many digits as there are
    const PatchFit fit = PatchFitter(options).fit(batch);
    ASSERT_TRUE(fit.surface.white);
    const Linearization& white = *fit.surface.white;
    const Eigen::MatrixXd pairs = overAllPairs(fit, batch, options).white;
    Eigen::MatrixXd sums = pairs;
    sums.topLeftCorner<6, 6>() = white.XX;
    sums.topRightCorner<6, 9>() = white.XD;
    sums.bottomRightCorner<9, 9>() = white.DD;
    sums.triangularView<Eigen::StrictlyLower>() = sums.transpose();
    const Eigen::VectorXd scale = pairs.diagonal().cwiseSqrt().cwiseInverse();
    EXPECT_LT((scale.asDiagonal() * (sums - pairs) * scale.asDiagonal())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9);

    const FitResult whole = estimatePatch(batch, FitOptions{});
    EXPECT_EQ(whole.white_state_covariance->size(), 0);
    const FitResult apart = estimatePatch(batch, options);
    const Eigen::VectorXd total = apart.state_covariance.diagonal();
    const Eigen::VectorXd own = apart.white_state_covariance->diagonal();
    EXPECT_TRUE((own.array() > 0.0).all() && (own.array() < total.array()).all());
  }
}

// The paper's sphere and cylinder take their normal from a weighted plane, a stage of
// its own that meets the same errors. Noise so weak that all is linear in it. The cells
// cost up to a seventh in single patches, see above.
TEST(Pattern, ReachesTheWeightedPlaneOfThePaper)
{
  Random random;
  constexpr double kWeak = 0.1;
  NoisePattern pattern = kinectPattern();
  for (PatternWave& wave : pattern.waves)
    wave.sigma *= kWeak;
  for (const SurfaceRequest surface :
       {SurfaceRequest::Sphere, SurfaceRequest::CircularCylinder})
    for (int patch = 0; patch < 3; ++patch) {
      const double radius = random.uniform(30.0, 50.0);
      PointBatch batch = disc(radius,
                              static_cast<int>(radius * 0.12),
                              -random.uniform(3.0, 5.0),
                              random.uniform(0.2, 0.6),
                              pattern,
                              0.05 * kWeak,
                              surface == SurfaceRequest::CircularCylinder);
      FitOptions options = FitOptions::paper();
      options.surface = surface;
      const FitResult fit = estimatePatch(batch, options);
      ASSERT_TRUE(isUsable(fit.status));
      MonteCarloOptions draws;
      draws.trials = 1500;
      draws.threads = 1;
      const StateMatrix drawn =
          monteCarloCovariance(fit.patch, batch, options, draws).state_covariance;
      // Of the normal and the centre, which rest on the plane.
      const auto nees = [&](const StateMatrix& S) {
        const Eigen::MatrixXd a = S.bottomRightCorner<5, 5>();
        const Eigen::MatrixXd b = drawn.bottomRightCorner<5, 5>();
        const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
        const Eigen::MatrixXd unit = scale.asDiagonal() * a * scale.asDiagonal();
        return unit.ldlt().solve(scale.asDiagonal() * b * scale.asDiagonal()).trace() /
               5.0;
      };
      EXPECT_NEAR(nees(fit.state_covariance), 1.0, 0.15) << radius << " px";
      batch.setPattern(nullptr);
      EXPECT_GT(nees(estimatePatch(batch, options).state_covariance), 3.0);
    }
}

// Their independence is what the paper's stages are made of.
TEST(Pattern, HasNoPlaceInThePapersChain)
{
  PointBatch batch = disc(30.0, 3, 2.0, 0.4, kinectPattern());
  const PatchEstimator chain(FitOptions::paper(), CovarianceMode::Stagewise);
  const ParameterMatrix with = chain.estimate(batch).covariance;
  batch.setPattern(nullptr);
  const ParameterMatrix without = chain.estimate(batch).covariance;
  const Eigen::VectorXd scale = without.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (with - without) * scale.asDiagonal())
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
}

// Nothing is summed where nothing is shared: to the last bit.
TEST(Pattern, WithoutWavesIsNone)
{
  NoisePattern still = kinectPattern();
  for (PatternWave& wave : still.waves)
    wave.sigma = 0.0;
  PointBatch batch = disc(16.0, 2, 2.0, 0.4, still);
  const FitResult with = estimatePatch(batch, FitOptions{});
  batch.setPattern(nullptr);
  const FitResult without = estimatePatch(batch, FitOptions{});
  EXPECT_EQ(pack(with.patch), pack(without.patch));
  EXPECT_EQ(with.covariance, without.covariance);
}

TEST(Pattern, ChangesTheCovarianceAndNotTheEstimate)
{
  PointBatch batch = disc(20.0, 2, 2.0, 0.4, kinectPattern());
  FitOptions options;
  options.surface = SurfaceRequest::Paraboloid;
  const FitResult with = estimatePatch(batch, options);
  batch.setPattern(nullptr);
  const FitResult without = estimatePatch(batch, options);
  EXPECT_EQ(pack(with.patch), pack(without.patch));
  EXPECT_EQ(with.chi2, without.chi2);
  EXPECT_GT(normalSigma(with), 2.0 * normalSigma(without));
  EXPECT_EQ(without.chi2_expected, without.chi2_dof);
  EXPECT_LT(with.chi2_expected, without.chi2_expected);
}

TEST(Pattern, RefusesWhatMakesNoSense)
{
  EXPECT_THROW(CorrelatedNoise({{{-0.1, 2.0, PatternShape::Gaussian}}}),
               std::invalid_argument);
  EXPECT_THROW(CorrelatedNoise({{{0.1, 0.0, PatternShape::Gaussian}}}),
               std::invalid_argument);
  EXPECT_THROW(CorrelatedNoise({{{0.1, NAN, PatternShape::Exponential}}}),
               std::invalid_argument);
}

TEST(Pattern, PointsWithoutAPixelAreLeftOut)
{
  PointBatch batch = disc(12.0, 2, 0.0, 0.4, kinectPattern());
  batch.channel(PointBatch::U)[3] = NAN;
  batch.channel(PointBatch::EZ)[7] = INFINITY;
  EXPECT_EQ(estimatePatch(batch, FitOptions{}).invalid_points, 2);
}

// A disc of pixels on a surface far away, tilted by up to a radian, with errors as the
// pattern has them: as large as the disc itself, or larger.
PointBatch
farDisc(double distance, double radius_px, double white_px, Random& random)
{
  const NoisePattern pattern = kinectPattern();
  StereoNoiseModel::Parameters parameters;
  parameters.sigma_point_px = 0.0;
  parameters.sigma_disparity_px = std::sqrt(pattern.variance() + white_px * white_px);
  const StereoNoiseModel noise(parameters);
  const Eigen::Vector3d centre(0.1 * distance, -0.05 * distance, distance);
  const double tilt = random.uniform(-1.0, 1.0), turn = random.uniform(-3.0, 3.0);
  const Eigen::Vector3d normal(std::sin(tilt) * std::cos(turn),
                               std::sin(tilt) * std::sin(turn),
                               -std::cos(tilt));
  const double kappa = random.uniform(-4.0, 4.0) / distance;
  PointBatch batch;
  batch.clear(centre);
  std::vector<Eigen::Vector2d> pixels;
  const int reach = static_cast<int>(radius_px);
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j)
      if (std::hypot(i, j) <= radius_px)
        pixels.emplace_back(std::round(0.1 * kFocal) + i,
                            std::round(-0.05 * kFocal) + j);
  const auto n = static_cast<Eigen::Index>(pixels.size());
  Eigen::MatrixXd C = white_px * white_px * Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd error(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    error[i] = random.normal();
    for (Eigen::Index j = 0; j < n; ++j)
      C(i, j) += pattern.covariance((pixels[i] - pixels[j]).norm());
  }
  error = (C.llt().matrixL() * error).eval();
  batch.setPattern(std::make_shared<const CorrelatedNoise>(pattern));
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d ray = (pixels[i] / kFocal).homogeneous();
    Eigen::Vector3d q = ray * (normal.dot(centre) / normal.dot(ray));
    q += 0.5 * kappa * (q - centre).squaredNorm() * normal;
    const Eigen::Vector3d r = noise.patternDirection(q);
    batch.add(q + error[i] * r, noise.covariance(q));
    for (int k = 0; k < 2; ++k)
      batch.channel(k == 0 ? PointBatch::U : PointBatch::V)[i] = pixels[i][k];
    for (int k = 0; k < 3; ++k)
      batch.channel(static_cast<PointBatch::Channel>(PointBatch::EX + k))[i] = r[k];
  }
  return batch;
}

// A surface leaves of chi2 what is white, and of what is shared no more than there is:
// whatever the residuals do to the Hessian. In the mean it is what chi2 is.
TEST(Pattern, ExpectedChi2HoldsFarAway)
{
  constexpr int kPatches = 300;
  double chi2 = 0.0, expected = 0.0;
  int usable = 0;
  for (std::uint64_t i = 0; i < kPatches; ++i) {
    Random random(i);
    const double white_px = random.uniform(0.02, 0.05);
    PointBatch batch =
        farDisc(random.uniform(2.0, 8.0), random.uniform(3.0, 9.0), white_px, random);
    const FitResult fit = estimatePatch(batch, FitOptions{});
    if (!isUsable(fit.status))
      continue;
    const double white = white_px * white_px;
    const double white_share = white / (white + kinectPattern().variance());
    EXPECT_GT(fit.chi2_expected, white_share * fit.chi2_dof);
    EXPECT_LT(fit.chi2_expected, fit.chi2_dof);
    chi2 += fit.chi2;
    expected += fit.chi2_expected;
    ++usable;
  }
  EXPECT_GT(usable, kPatches / 2);
  // The cells cost some hundredths, as above.
  EXPECT_NEAR(chi2 / expected, 1.0, 0.05);
}

// An exponential wave as seven Gaussian ones.
TEST(CorrelatedNoise, ComponentsAddUpToThePattern)
{
  const NoisePattern pattern{{{1.0, 10.0, PatternShape::Exponential}}};
  const CorrelatedNoise noise(pattern);
  const auto sum = [&](double distance) {
    double total = 0.0;
    for (const CorrelatedNoise::Component& wave : noise.components())
      total += wave.variance *
               std::exp(-0.5 * distance * distance / (wave.length_px * wave.length_px));
    return total;
  };
  EXPECT_NEAR(sum(0.0), 1.0, 1e-12);
  for (double distance = 1.0; distance < 40.0; distance += 0.5)
    EXPECT_NEAR(sum(distance), pattern.covariance(distance), 0.01) << distance;
}

// The referee draws errors over all pairs of points.
TEST(Pattern, MonteCarloAgreesWithTheCovariance)
{
  PointBatch batch = disc(14.0, 2, 3.0, 0.5, kinectPattern());
  FitOptions options;
  options.surface = SurfaceRequest::CircularParaboloid;
  const FitResult fit = estimatePatch(batch, options);
  ASSERT_TRUE(isUsable(fit.status));
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = 2000;
  const MonteCarloResult drawn =
      monteCarloCovariance(fit.patch, batch, options, monte_carlo);
  // The variance of a variance over 2000 trials is 3 %; the normal's and the centre's
  // are what the pattern changes most. Cells: see above.
  const ParameterMatrix found = toTangent(fit.patch, drawn.covariance);
  const ParameterMatrix said = toTangent(fit.patch, fit.covariance);
  const int r = layoutOf(fit.patch.type).r(), c = layoutOf(fit.patch.type).c();
  for (const int i : {r, r + 1, c, c + 1, c + 2})
    EXPECT_NEAR(said(i, i) / found(i, i), 1.0, 0.15) << i;
}

// Points at random pixels with random directions, padded.
PointBatch
randomBatch(int count, Random& random)
{
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  for (int i = 0; i < count; ++i) {
    batch.add(random.normalVector(), Eigen::Matrix3d::Identity());
    for (int c = PointBatch::U; c <= PointBatch::EXTRA; ++c)
      batch.channel(static_cast<PointBatch::Channel>(c))[i] =
          random.uniform(-20.0, 20.0);
  }
  batch.setPattern(std::make_shared<const CorrelatedNoise>(kinectPattern()));
  batch.pad();
  return batch;
}

// Both codes: the fast one shows that vectors agree, the reference what they do.
class PatternKernel : public testing::TestWithParam<const kernel::Kernel*> {
protected:
  static constexpr double kRounding = 1e-12; // of numbers up to 1e3
};

TEST_P(PatternKernel, PixelSumsAreThoseOfThePointsWithoutPadding)
{
  for (int count = 1; count <= 2 * PointBatch::kLaneMultiple + 1; ++count) {
    Random random(static_cast<std::uint64_t>(count));
    const PointBatch batch = randomBatch(count, random);
    const kernel::PatternPoints shared = kernelPattern(batch);
    kernel::Points points = kernelPoints(batch);
    points.pattern = &shared;
    const double about[2] = {3.0, -2.0};
    kernel::PixelSums sums;
    GetParam()->accumulatePixels(points, about, sums);
    const Eigen::Map<const Eigen::ArrayXd> u(shared.pixel[0], count);
    const Eigen::Map<const Eigen::ArrayXd> v(shared.pixel[1], count);
    const Eigen::ArrayXd du = u - about[0], dv = v - about[1];
    EXPECT_EQ(sums.low[0], u.minCoeff());
    EXPECT_EQ(sums.low[1], v.minCoeff());
    EXPECT_EQ(sums.high[0], u.maxCoeff());
    EXPECT_EQ(sums.high[1], v.maxCoeff());
    EXPECT_NEAR(sums.sum[0], du.sum(), count * kRounding);
    EXPECT_NEAR(sums.sum[1], dv.sum(), count * kRounding);
    EXPECT_NEAR(sums.squares[0], du.square().sum(), count * kRounding);
    EXPECT_NEAR(sums.squares[1], (du * dv).sum(), count * kRounding);
    EXPECT_NEAR(sums.squares[2], dv.square().sum(), count * kRounding);
  }
}

TEST_P(PatternKernel, NeighborsAreAllInTheMiddleAndHalfAtTheEdge)
{
  Random random;
  const PointBatch batch = randomBatch(40, random);
  const kernel::PatternPoints shared = kernelPattern(batch);
  kernel::Points points = kernelPoints(batch);
  points.pattern = &shared;
  PaddedRows rows;
  rows.resize(1, batch.paddedSize());
  double* const out = rows.row(0);
  const kernel::NeighborVariance neighbors{{1.0, 2.0},
                                           {0.06, 0.02, 0.05},
                                           3.0,
                                           0.5,
                                           0.4};
  GetParam()->neighborVariances(points, neighbors, out);
  for (int i = 0; i < batch.size(); ++i) {
    const double u = shared.pixel[0][i] - 1.0, v = shared.pixel[1][i] - 2.0;
    const double inside = 1.0 - std::hypot(0.06 * u, 0.02 * u + 0.05 * v);
    const double expected = inside <= 0.0 ? 1.0 :
                            inside >= 0.4 ? 2.5 :
                                            2.5 - 1.5 * std::pow(1.0 - inside / 0.4, 2);
    EXPECT_NEAR(out[i], expected, kRounding);
  }
}

// y_i of the points, by cells, from the X_i of every point.
Eigen::MatrixXd
expectedCells(const PointBatch& batch,
              const kernel::Points& points,
              const kernel::State& state,
              Residual residual)
{
  constexpr int kModel = kernel::kMaxTheta;
  const kernel::PatternPoints& shared = *points.pattern;
  std::vector<double> X;
  kernel::crossTerms(kernel::Model::Paraboloid, residual, points, state, X);
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix3d>(state.R).transpose();
  const Eigen::Map<const Eigen::Vector3d> c(state.c), centroid(state.centroid);
  Eigen::MatrixXd cells =
      Eigen::MatrixXd::Zero(kernel::kCells * kernel::kCells, kernel::kCellRow);
  for (int i = 0; i < batch.size(); ++i) {
    const auto cell = [&](int k) {
      const double at =
          (shared.pixel[k][i] - shared.grid.corner[k]) * shared.grid.inverse_side;
      return std::clamp(static_cast<int>(std::floor(at)), 0, kernel::kCells - 1);
    };
    const Eigen::Vector3d r = R.transpose() * Eigen::Vector3d(shared.direction[0][i],
                                                              shared.direction[1][i],
                                                              shared.direction[2][i]);
    const Eigen::Vector3d q =
        R.transpose() * (batch.point(i) - batch.origin() - c) - centroid;
    Eigen::Matrix<double, kernel::kCellRow, 1> y;
    y.setZero();
    for (int a = 0; a < kModel; ++a)
      y[a] = Eigen::Map<const Eigen::Vector3d>(&X[3 * (kModel * i + a)]).dot(r);
    y.segment<3>(6) = r / batch.size();
    for (int e = 0; e < symmetric::kSize; ++e) {
      const int b = symmetric::kRow[e], d = symmetric::kColumn[e];
      y[9 + e] = (q[b] * r[d] + q[d] * r[b]) / batch.size();
    }
    cells.row(kernel::kCells * cell(1) + cell(0)) += y.transpose();
  }
  return cells;
}

// By the feet of the rays and by the chain rule, in single precision and in double.
TEST_P(PatternKernel, CovariancePassSumsResponsesAndMomentsInCells)
{
  for (const Residual residual : {Residual::Ray, Residual::Sampson})
    for (const auto precision : {kernel::Precision::Single, kernel::Precision::Double})
      for (const double radius_px : {3.0, 11.0}) {
        PointBatch batch = disc(radius_px, 1, 0.5, 0.4, kinectPattern());
        batch.pad();
        const Scatter scatter = measureScatter(batch, false, -batch.origin());
        UnboundedSurface surface;
        surface.model = kernel::Model::Paraboloid;
        surface.R = scatter.axes;
        surface.c = scatter.mean;
        surface.k << 0.3, 0.0, 0.6;
        const kernel::State state = kernelState(surface, scatter);
        kernel::CellSums cells;
        kernel::PatternPoints shared = kernelPattern(batch);
        // Some pixels lie outside.
        shared.grid = {{shared.pixel[0][0] - 1.0, shared.pixel[1][0] + 1.0}, 0.7};
        shared.cells = &cells;
        kernel::Points points = kernelPoints(batch);
        points.pattern = &shared;
        kernel::CovarianceSums sums;
        GetParam()->accumulateCovariance(precision,
                                         kernel::Model::Paraboloid,
                                         residual,
                                         points,
                                         state,
                                         sums);
        const Eigen::MatrixXd expected = expectedCells(batch, points, state, residual);
        const double rounding = precision == kernel::Precision::Single ? 1e-5 : 1e-12;
        for (int k = 0; k < kernel::kCellRow; ++k) {
          const double largest = expected.col(k).cwiseAbs().maxCoeff();
          for (int cell = 0; cell < expected.rows(); ++cell)
            EXPECT_NEAR(cells.y[cell][k], expected(cell, k), rounding * largest)
                << cell << " " << k;
        }
      }
}

TEST_P(PatternKernel, SumsOverCellsAreThoseOverAllPairsOfThem)
{
  constexpr int kCells = kernel::kCells, kRow = kernel::kCellRow;
  for (const auto precision : {kernel::Precision::Single, kernel::Precision::Double}) {
    Random random;
    kernel::CellSums cells;
    Eigen::MatrixXd y(kCells * kCells, kRow), C(kCells * kCells, kCells * kCells);
    for (int cell = 0; cell < kCells * kCells; ++cell)
      for (int k = 0; k < kRow; ++k)
        cells.y[cell][k] = y(cell, k) = random.normal();
    for (auto& row : cells.covariance)
      for (double& entry : row)
        entry = random.uniform(0.0, 1.0);
    for (int a = 0; a < C.rows(); ++a)
      for (int b = 0; b < C.cols(); ++b)
        C(a, b) = cells.covariance[std::abs(a / kCells - b / kCells)]
                                  [std::abs(a % kCells - b % kCells)];
    alignas(64) double sum[kRow][kRow];
    GetParam()->sumOverCells(precision, cells, sum[0]);
    const Eigen::MatrixXd pairs = y.transpose() * C * y;
    // Of sums of 64 terms, each within half a unit in the last place.
    const double rounding = precision == kernel::Precision::Single ? 1e-6 : 1e-13;
    const double largest = pairs.cwiseAbs().maxCoeff();
    for (int a = 0; a < kRow; ++a)
      for (int b = 0; b < kRow; ++b)
        EXPECT_NEAR(sum[a][b], pairs(a, b), rounding * largest);
  }
}

INSTANTIATE_TEST_SUITE_P(Codes,
                         PatternKernel,
                         testing::Values(&kernel::kernel(), &kernel::referenceKernel()),
                         [](const auto& code) {
                           return std::string(code.index == 0 ? "vectors" :
                                                                "reference");
                         });

}} // namespace holdfast
