#include <holdfast/sensor/pattern_calibration.h>

#include "support/correlated_field.h"
#include "support/disparity_image.h"
#include "support/random.h"
#include "support/tally.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

namespace holdfast { namespace {

using test::imageOf, test::kFocalTimesBaseline;

using test::Tally;

constexpr double kWhite = 0.05; // px

NoiseCalibrationOptions
optionsFor(const Camera& camera)
{
  NoiseCalibrationOptions options;
  options.camera = camera;
  return options;
}

/// Frames of a plane, tilted at random, between 0.6 and 2.2 m, with a pattern that
/// stays and white noise that does not.
PoseFrames
randomPose(int frames, const std::vector<double>& pattern, test::Random& random)
{
  const Camera camera;
  const double level = random.uniform(35.0, 55.0);
  const double along_u = random.uniform(-0.02, 0.02);
  const double along_v = random.uniform(-0.04, 0.04);
  PoseFrames pose;
  for (int t = 0; t < frames; ++t)
    pose.push_back(imageOf(camera, [&](int u, int v) {
      const auto i = static_cast<std::size_t>(v * camera.width + u);
      return level + along_u * (u - camera.cx) + along_v * (v - camera.cy) +
             (pattern.empty() ? 0.0 : pattern[i]) + kWhite * random.normal();
    }));
  return pose;
}

/// Several patterns of one kind must be found again.
/// \param bias of the long wave's sigma and length allowed, relative: there are some
/// ten such waves in an image, and the fit is not linear in the length.
/// \param least how many of 12 must have the long wave's shape.
void
checkPattern(const NoisePattern& truth, int frames, double bias, int least)
{
  constexpr std::uint64_t kCases = 12;
  const PatternWave &brief = truth.waves[0], &wide = truth.waves[1];
  const test::CorrelatedField field(truth, 640, 480, 300);
  const double whole = std::sqrt(kWhite * kWhite + truth.variance());
  Tally single("single", whole), white("white", kWhite), sigma("sigma", brief.sigma),
      length("length", brief.length_px), wide_sigma("wide sigma", wide.sigma),
      wide_length("wide length", wide.length_px);
  int right_shapes = 0;
  for (std::uint64_t i = 0; i < kCases; ++i) {
    test::Random random(i);
    const std::vector<double> pattern = field.draw(random);
    const PatternCalibration found =
        calibratePattern({randomPose(frames, pattern, random)}, optionsFor(Camera{}));
    ASSERT_EQ(found.status, NoiseCalibrationStatus::Ok);
    ASSERT_EQ(found.waves.size(), 2u);
    EXPECT_EQ(found.waves[0].shape, PatternShape::Exponential);
    EXPECT_FALSE(found.shared_part.isKnown());
    single.add(found.single);
    white.add(found.white);
    sigma.add(found.waves[0].sigma);
    length.add(found.waves[0].length);
    if (found.waves[1].shape != wide.shape)
      continue; // another length then, too
    ++right_shapes;
    wide_sigma.add(found.waves[1].sigma);
    wide_length.add(found.waves[1].length);
  }
  EXPECT_GE(right_shapes, least);
  single.expectRight(bias * whole);
  white.expectRight();
  sigma.expectRight();
  length.expectRight();
  wide_sigma.expectRight(bias * wide.sigma);
  wide_length.expectRight(bias * wide.length_px);
}

TEST(PatternCalibration, FindsShortAndGaussianWaves)
{
  checkPattern({{{0.101, 1.6, PatternShape::Exponential},
                 {0.089, 35.0, PatternShape::Gaussian}}},
               1,
               0.05,
               8);
}

// What is exponential is never taken for smooth, but for one case by chance.
TEST(PatternCalibration, FindsExponentialWavesInSeveralFrames)
{
  checkPattern({{{0.12, 3.0, PatternShape::Exponential},
                 {0.1, 40.0, PatternShape::Exponential}}},
               3,
               0.05,
               11);
}

// Where an interval reaches the longest length that is searched, it says so.
TEST(PatternCalibration, LengthsNearTheLongestHaveOpenIntervals)
{
  const NoisePattern truth{
      {{0.1, 2.0, PatternShape::Exponential}, {0.1, 79.0, PatternShape::Exponential}}};
  const test::CorrelatedField field(truth, 640, 480, 300);
  Tally length("length", 79.0);
  int open = 0;
  for (std::uint64_t i = 0; i < 12; ++i) {
    test::Random random(i);
    const std::vector<double> pattern = field.draw(random);
    const PatternCalibration found =
        calibratePattern({randomPose(1, pattern, random)}, optionsFor(Camera{}));
    ASSERT_EQ(found.waves.size(), 2u);
    EXPECT_EQ(found.waves[1].shape, PatternShape::Exponential);
    const Estimate& wide = found.waves[1].length;
    EXPECT_LE(wide.low, wide.value);
    EXPECT_LE(wide.value, 80.0 * (1.0 + 1e-9));
    EXPECT_TRUE(wide.high < 80.0 || std::isinf(wide.high)) << wide.high;
    open += std::isinf(wide.high) ? 1 : 0;
    length.add(wide);
  }
  EXPECT_GE(open, 6);
  length.expectCovered();
}

TEST(PatternCalibration, IndependentNoiseHasNoWaves)
{
  int waves = 0;
  Tally single("single", kWhite), white("white", kWhite);
  for (std::uint64_t i = 0; i < 10; ++i) {
    test::Random random(i);
    const PatternCalibration found =
        calibratePattern({randomPose(1, {}, random)}, optionsFor(Camera{}));
    waves += found.waves.empty() ? 0 : 1;
    // A wave that is there by chance, as in one of twenty, is next to nothing.
    EXPECT_LT(found.pattern().variance(), 0.02 * kWhite * kWhite);
    single.add(found.single);
    white.add(found.white);
  }
  EXPECT_LE(waves, 4);
  single.expectRight();
}

TEST(PatternCalibration, OtherPosesTellTheCameraFromTheSurface)
{
  const NoisePattern pattern{{{0.1, 2.0, PatternShape::Exponential}}};
  const test::CorrelatedField field(pattern, 640, 480, 100);
  // Of all, white part and two patterns of 0.1 px, one is in both poses.
  Tally shared("shared", 0.01 / (kWhite * kWhite + 0.02));
  for (std::uint64_t i = 0; i < 10; ++i) {
    test::Random random(i);
    const std::vector<double> camera = field.draw(random);
    std::vector<PoseFrames> poses;
    for (int p = 0; p < 2; ++p) {
      std::vector<double> sum = field.draw(random);
      for (std::size_t k = 0; k < sum.size(); ++k)
        sum[k] += camera[k];
      poses.push_back(randomPose(1, sum, random));
    }
    const PatternCalibration found = calibratePattern(poses, optionsFor(Camera{}));
    ASSERT_EQ(found.poses, 2);
    shared.add(found.shared_part);
    EXPECT_NEAR(found.single.value, std::sqrt(kWhite * kWhite + 0.02), 0.005);
  }
  shared.expectRight();
}

TEST(PatternCalibration, NamesThePoseWithoutPlanes)
{
  test::Random random;
  const PoseFrames good = randomPose(1, {}, random);
  const PoseFrames bumpy{imageOf(Camera{}, [&](int u, int v) {
    return 40.0 + 2.0 * std::sin(u / 6.4) * std::sin(v / 6.4) + 0.05 * random.normal();
  })};
  const PoseFrames empty{imageOf(Camera{}, [](int, int) { return std::nan(""); })};
  PatternCalibration found = calibratePattern({good, bumpy}, optionsFor(Camera{}));
  EXPECT_EQ(found.status, NoiseCalibrationStatus::NothingFlat);
  EXPECT_EQ(found.pose, 1);
  EXPECT_TRUE(found.waves.empty());
  found = calibratePattern({empty, good}, optionsFor(Camera{}));
  EXPECT_EQ(found.status, NoiseCalibrationStatus::NothingStatic);
  EXPECT_EQ(found.pose, 0);
}

TEST(PatternCalibration, RejectsMisuse)
{
  test::Random random;
  const PoseFrames good = randomPose(1, {}, random);
  NoiseCalibrationOptions options = optionsFor(Camera{});
  EXPECT_THROW(calibratePattern({}, options), std::invalid_argument);
  EXPECT_THROW(calibratePattern({good, {}}, options), std::invalid_argument);
  PoseFrames turned = good;
  turned[0].width = 480;
  turned[0].height = 640;
  EXPECT_THROW(calibratePattern({good, turned}, options), std::invalid_argument);
  options.baseline_m = 0.0;
  EXPECT_THROW(calibratePattern({good}, options), std::invalid_argument);
}

}} // namespace holdfast
