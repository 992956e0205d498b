// Fusion of many views of one spot: NEES, sigma and gate against the truth (FUSION 2,
// 3).
#include "support/chi_square_bounds.h"
#include "support/kinect_pattern.h"
#include "support/spot.h"

#include <holdfast/fusion/jet_filter.h>
#include <holdfast/fusion/patch_map.h>
#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/rotation.h>

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <map>
#include <vector>

namespace holdfast { namespace {

using test::Random;

constexpr double kRadius = 0.05;
constexpr int kStride = 4; // some 140 points

struct Trials {
  std::map<int, double> nees; ///< mean over trials, by number of views
  std::map<int, double> sigma; ///< of the height, root mean square
  std::map<int, double> noise_sigma; ///< the same without third derivatives
  double gated = 0.0; ///< share of the measurements
};

struct TrialOptions {
  double s3 = 0.0; ///< of the surface, 1/m^2
  double offset_m = 0.0; ///< of the supports' centres, at most
  int trials = 200;
  std::vector<int> views{1, 4, 16};
  int max_views = 1 << 20; ///< no fading
};

/// Maps of one patch from views whose poses are known, against the best quadric over
/// the patch's own disc.
Trials
fuse(const TrialOptions& o)
{
  const Sensor sensor = test::kinect();
  const PatchEstimator estimator(test::paraboloidOptions());
  Trials result;
  int measured = 0, gated = 0;
  for (int trial = 0; trial < o.trials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial));
    const Scene scene = test::reliefScene(test::randomThirdDerivatives(random, o.s3));
    PatchMapOptions options;
    options.max_views = o.max_views;
    options.max_tilt_rad = 1.0; // offsets are what is looked at
    PatchMap map(options);
    for (int view = 1; view <= o.views.back(); ++view) {
      const Pose pose = test::randomView(random);
      Eigen::Vector3d place = Eigen::Vector3d::Zero();
      if (view > 1) {
        const double angle = random.uniform(0.0, 6.283);
        const double length = o.offset_m * std::sqrt(random.uniform(0.0, 1.0));
        place = length * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      }
      const SpotView seen(scene, sensor, pose, test::discAt(place), kRadius, kStride);
      auto m = seen.measure(estimator, random.engine());
      if (!m)
        continue;
      m->id = 1;
      // Known far better than anything is measured.
      map.place(pose, 1e-18 * JetMatrix::Identity());
      const UpdateReport report = map.update({*m});
      ++measured;
      gated += report.gated + report.replaced;
      const MapPatch& patch = map.patches().front();
      if (std::find(o.views.begin(), o.views.end(), view) == o.views.end())
        continue;
      const auto truth = trueJet(scene, patch.anchor, kRadius);
      if (!truth)
        continue;
      const JetMatrix P = patch.jet.covariance();
      result.nees[view] += test::nees(patch.jet.value(), P, *truth) / 6.0 / o.trials;
      result.sigma[view] += P(0, 0) / o.trials;
      result.noise_sigma[view] += patch.jet.state().joint.v[0] / o.trials;
    }
  }
  for (auto* sigmas : {&result.sigma, &result.noise_sigma})
    for (auto& sigma : *sigmas)
      sigma.second = std::sqrt(sigma.second);
  result.gated = static_cast<double>(gated) / measured;
  return result;
}

void
print(const Trials& trials)
{
  for (const auto& [views, nees] : trials.nees)
    std::printf("  n = %2d: NEES/dof %.3f, sigma %.3f mm\n",
                views,
                nees,
                1e3 * trials.sigma.at(views));
  std::printf("  gated %.2f %%\n", 100.0 * trials.gated);
}

/// The band that FUSION 8 states, wider by what the mean of that many chi-square draws
/// of six degrees of freedom may be off by chance: one standard error.
void
expectWithin(double nees, double low, double high, int trials)
{
  const double error = std::sqrt(2.0 / 6.0 / trials);
  EXPECT_GT(nees, low - error);
  EXPECT_LT(nees, high + error);
}

// F2. A single fit is off by 0.04 of its sigma on average, to second order in the noise
// (height and curvature; FitResult::mean_shift has it), which 64 views, whose sigma is
// an eighth of that, show: 0.3 sigma in three of six numbers make 1.11 of 1.06. Fading,
// which is off here, ends at sixteen.
TEST(JetFilter, SameSupportIsConsistent)
{
  TrialOptions o;
  o.views = {1, 4, 16, 64};
  const Trials trials = fuse(o);
  print(trials);
  for (const int views : {1, 4, 16})
    expectWithin(trials.nees.at(views), 0.95, 1.08, o.trials);
  expectWithin(trials.nees.at(64), 0.95, 1.08 + 0.05, o.trials);
  // That there are no third derivatives, a single patch cannot tell: what they might do
  // averages no more than supports differ.
  EXPECT_NEAR(trials.noise_sigma.at(4) / trials.noise_sigma.at(64), 4.0, 0.4);
  EXPECT_GT(trials.gated, 0.007);
  EXPECT_LT(trials.gated, 0.016);
}

// F3.
TEST(JetFilter, OtherSupportsCountAsFarAsTheyDiffer)
{
  TrialOptions o;
  o.s3 = 30.0;
  o.offset_m = 0.01;
  const Trials trials = fuse(o);
  print(trials);
  for (const auto& row : trials.nees)
    expectWithin(row.second, 0.8, 1.2, o.trials);
}

/// What a fit to a support that is off by a share of the radius, in any direction,
/// makes of third derivatives beside what the disc does.
ThirdToJet
offDisc(Random& random, const Eigen::Vector2d& middle)
{
  Pose off;
  off.c << kRadius * (middle + 0.1 * Eigen::Vector2d(random.normal(), random.normal())),
      0.0;
  const ThirdToJet disc = thirdToJetOfDisc(kRadius);
  return movedThirdToJet(1.2 * disc, off) - disc;
}

/// Numbers as a fit has them with a sigma of the height of 0.5 mm.
JetVector
noise(Random& random)
{
  JetVector w;
  w << 5e-4 * random.normal(), 1e-2 * random.normalVector().head<2>(),
      random.normalVector();
  return w;
}

// Views from one side weigh the same points alike: what third derivatives do is the
// same error in each of them, and averages over no number of views.
TEST(JetFilter, ThirdDerivativesDoNotAverage)
{
  constexpr int kTrials = 1000;
  constexpr double kS3 = 200.0;
  JetVector variance;
  variance << 25e-8, 1e-4, 1e-4, 1.0, 1.0, 1.0;
  std::map<int, double> nees;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial));
    const Eigen::Vector4d t = test::randomThirdDerivatives(random, kS3);
    const Eigen::Vector2d middle(0.2 * random.normal(), 0.2 * random.normal());
    JetFilter filter;
    for (int view = 1; view <= 64; ++view) {
      const ThirdToJet D = offDisc(random, middle);
      const JetVector jet = D * t + noise(random); // of nothing
      if (view == 1)
        filter =
            JetFilter({jet, variance.asDiagonal(), JetMatrix::Zero()}, D, 0.5 * kS3);
      else
        ASSERT_TRUE(filter.update(jet,
                                  variance.asDiagonal(),
                                  std::numeric_limits<double>::infinity(),
                                  D));
      JetFilter known = filter; // how large they are comes out later
      known.setRoughness(kS3);
      nees[view] += test::nees(known.value(), known.covariance(), JetVector::Zero());
    }
  }
  constexpr int kDegrees = 6 * kTrials;
  const test::NeesBounds bounds(kDegrees);
  for (const int views : {1, 4, 16, 64}) {
    const double mean = nees.at(views) / kDegrees;
    std::printf("  n = %2d: NEES/dof %.3f\n", views, mean);
    EXPECT_GT(mean, bounds.lowest);
    EXPECT_LT(mean, bounds.highest);
  }
}

TEST(JetFilter, FadingKeepsWhatDoesNotAverage)
{
  TrialOptions o;
  o.s3 = 100.0;
  o.offset_m = 0.01;
  o.trials = 100;
  o.views = {64};
  o.max_views = PatchMapOptions().max_views;
  const Trials trials = fuse(o);
  print(trials);
  expectWithin(trials.nees.at(64), 0.5, 1.1, o.trials);
}

// F4. chi2 grows with the sixth power of the radius, against a scatter of sqrt(2 n): at
// 8 cm and 1400 points 300 views tell 30 /m^2 to 3 %, at 5 cm and 140 points not at
// all.
TEST(JetFilter, ThirdDerivativesAreMeasured)
{
  const PatchEstimator estimator(test::paraboloidOptions());
  constexpr double kWide = 0.08;
  for (const double s3 : {30.0, 60.0, 100.0}) {
    double excess = 0.0, weight = 0.0;
    for (int trial = 0; trial < 300; ++trial) {
      Random random(static_cast<std::uint64_t>(trial));
      const Scene scene = test::reliefScene(test::randomThirdDerivatives(random, s3),
                                            {-2.0, 0.0, -3.0});
      const SpotView seen(scene,
                          test::kinect(),
                          test::randomView(random),
                          Pose(),
                          kWide,
                          2);
      const auto m = seen.measure(estimator, random.engine());
      ASSERT_TRUE(m);
      excess += m->chi2 - m->chi2_expected;
      weight += m->design.chi2_per_roughness;
    }
    const double measured = std::sqrt(std::max(0.0, excess / weight));
    std::printf("  s3 %.0f: %.1f\n", s3, measured);
    EXPECT_NEAR(measured, s3, 0.2 * s3);
  }
}

/// Increments of a sensor that wanders about a spot, and what is known of them.
struct Wander {
  Pose pose;
  double sigma_rad, sigma_m;

  /// \return the increment as odometry has it.
  Pose step(Random& random, const Pose& next)
  {
    const Pose increment = pose.inverse() * next;
    pose = next;
    Pose measured = increment;
    const Eigen::Vector3d turn = sigma_rad * random.normalVector();
    measured.R = increment.R * expMap(turn);
    measured.c += sigma_m * random.normalVector();
    return measured;
  }

  JetMatrix covariance() const
  {
    JetVector variance;
    variance << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
        Eigen::Vector3d::Constant(sigma_m * sigma_m);
    return variance.asDiagonal();
  }
};

// F5: of where the patch lies from the sensor, after 25 frames with odometry.
TEST(JetFilter, OdometryErrorsAreInTheCovariance)
{
  const PatchEstimator estimator(test::paraboloidOptions());
  const Scene scene = test::reliefScene();
  for (const double scale : {1.0, 4.0}) {
    constexpr int kTrials = 300, kFrames = 25;
    double nees = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      Random random(static_cast<std::uint64_t>(trial));
      Wander wander{test::randomView(random), 0.5e-3 * scale, 0.5e-3 * scale};
      PatchMapOptions options;
      options.max_views = kFrames; // fading makes it less sure than it is
      PatchMap map(options);
      for (int frame = 0; frame < kFrames; ++frame) {
        if (frame > 0) {
          const Pose increment = wander.step(random, test::randomView(random));
          map.move(increment, wander.covariance());
        }
        const SpotView seen(scene,
                            test::kinect(),
                            wander.pose,
                            Pose(),
                            kRadius,
                            kStride);
        auto m = seen.measure(estimator, random.engine());
        ASSERT_TRUE(m);
        map.update({*m});
      }
      const MapPatch& patch = map.patches().front();
      const Pose in_sensor = map.pose().inverse() * patch.anchor;
      const auto truth = trueJet(scene, wander.pose * in_sensor, kRadius);
      ASSERT_TRUE(truth);
      nees +=
          test::nees(patch.jet.value(), patch.jet.covariance(), *truth) / 6.0 / kTrials;
    }
    std::printf("  odometry x %.0f: NEES/dof %.3f\n", scale, nees);
    // With coarse odometry little more than the last view counts, whose own is F2's.
    expectWithin(nees, 0.95, scale > 1.0 ? 1.08 : 1.05, kTrials);
  }
}

// F6: a still camera whose error is to 70 % the same in every frame. White in space,
// and as recorded Kinects have it.
TEST(JetFilter, StillCameraKeepsItsPattern)
{
  const PatchEstimator estimator(test::paraboloidOptions());
  const Scene scene = test::reliefScene();
  const double share =
      std::sqrt(0.7) * StereoNoiseModel::Parameters{}.sigma_disparity_px;
  const NoisePattern white_in_space{{{share, 0.2, PatternShape::Gaussian}}};
  for (const NoisePattern& pattern : {white_in_space, test::kinectPattern()}) {
    constexpr int kTrials = 150, kFrames = 30;
    Sensor sensor = test::kinect();
    sensor.pattern = pattern;
    double nees = 0.0, naive = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      Random random(static_cast<std::uint64_t>(trial));
      const Pose pose = test::randomView(random);
      SpotView seen(scene, sensor, pose, Pose(), kRadius, kStride);
      seen.drawPattern(random.engine());
      PatchMap map;
      PatchMapOptions forgetful;
      forgetful.pattern.clear(); // each view has a pattern of its own
      forgetful.max_depth_change = 1e-12;
      PatchMap other(forgetful);
      for (int frame = 0; frame < kFrames; ++frame) {
        const auto m = seen.measure(estimator, random.engine());
        ASSERT_TRUE(m);
        map.update({*m});
        other.update({*m});
      }
      const auto mean = [&](const PatchMap& in) {
        const MapPatch& patch = in.patches().front();
        const auto truth = trueJet(scene, pose * patch.anchor, kRadius);
        return test::nees(patch.jet.value(), patch.jet.covariance(), *truth) / 6.0 /
               kTrials;
      };
      nees += mean(map);
      naive += mean(other);
    }
    std::printf("  NEES/dof %.3f, of views as if independent %.2f\n", nees, naive);
    expectWithin(nees, 0.95, 1.05, kTrials);
    EXPECT_GT(naive, 3.0);
  }
}

}} // namespace holdfast
