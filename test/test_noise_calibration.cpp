#include <holdfast/sensor/noise_calibration.h>
#include <holdfast/simulation/simulator.h>

#include "support/disparity_image.h"
#include "support/random.h"
#include "support/tally.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast { namespace {

using test::imageOf, test::kFocalTimesBaseline;

using test::Tally;

NoiseCalibrationOptions
optionsFor(const Camera& camera)
{
  NoiseCalibrationOptions options;
  options.camera = camera;
  return options;
}

/// One value per pixel, row by row.
using Field = std::vector<double>;

/// Gaussian random field of standard deviation sigma: white noise averaged over squares
/// of 2 reach + 1 px. Its covariance is a product of two triangles of that half-width.
Field
smoothField(int width, int height, int reach, double sigma, test::Random& random)
{
  const auto along = [](const Field& in, int n, int stride, int r) {
    Field out(in.size(), 0.0);
    for (std::size_t i = 0; i < in.size(); ++i) {
      const int k = static_cast<int>(i) / stride % n;
      for (int d = -r; d <= r; ++d) {
        const int wrapped = (k + d + n) % n;
        out[i] +=
            in[static_cast<std::size_t>(static_cast<int>(i) + (wrapped - k) * stride)];
      }
      out[i] /= std::sqrt(2.0 * r + 1.0);
    }
    return out;
  };
  Field white(static_cast<std::size_t>(width * height));
  for (double& value : white)
    value = sigma * random.normal();
  return along(along(white, width, 1, reach), height, width, reach);
}

Camera
smallCamera()
{
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 575.8;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

/// A tilted plane between 0.8 and 1.6 m.
double
planeDisparity(int u, int v)
{
  return 30.0 + 0.05 * u + 0.12 * v;
}

std::vector<PointImage>
planeFrames(int count, double sigma, const Field& pattern, test::Random& random)
{
  const Camera camera = smallCamera();
  std::vector<PointImage> frames;
  for (int t = 0; t < count; ++t)
    frames.push_back(imageOf(camera, [&](int u, int v) {
      const double fixed =
          pattern.empty() ? 0.0 : pattern[static_cast<std::size_t>(v * 160 + u)];
      return planeDisparity(u, v) + fixed + sigma * random.normal();
    }));
  return frames;
}

/// For a single case, which an interval of 95 % misses now and then: four standard
/// errors.
bool
isNear(const Estimate& estimate, double truth)
{
  const double half = 0.5 * (estimate.high - estimate.low);
  return std::abs(estimate.value - truth) <= 2.0 * half;
}

// What the sensor below has: that of kinect_v1.yaml.
constexpr double kSigmaDisparity = 0.17; // px
constexpr double kSigmaPoint = 0.35; // px
constexpr double kQuantum = 0.125; // px

/// A scene as a sensor sees it whose errors are those of the stereo model exactly: the
/// library's own simulator draws them in depth, to first order, which at 4 m makes the
/// variance of the disparity 0.2 % larger.
class SimulatedScene {
public:
  explicit SimulatedScene(const std::string& scene)
  : image_(castRays(makeScene(scene), pixelRays(Camera{}), 0.5, 8.0))
  {}

  /// \param quantize whether disparities come in steps.
  /// \param pattern added to the disparities before they are rounded, if not empty.
  std::vector<PointImage> frames(int count,
                                 bool quantize,
                                 const Field& pattern,
                                 test::Random& random) const
  {
    std::vector<PointImage> frames;
    for (int t = 0; t < count; ++t) {
      PointImage& frame = frames.emplace_back();
      frame.width = image_.width;
      frame.height = image_.height;
      for (std::size_t i = 0; i < image_.truth.size(); ++i)
        frame.points.push_back(measured(image_.sensor_pose.toLocal(image_.truth[i]),
                                        pattern.empty() ? 0.0 : pattern[i],
                                        quantize,
                                        random)
                                   .cast<float>());
    }
    return frames;
  }

private:
  static Eigen::Vector3d measured(const Eigen::Vector3d& q,
                                  double pattern,
                                  bool quantize,
                                  test::Random& random)
  {
    double d = kFocalTimesBaseline / q.z() + pattern;
    d += kSigmaDisparity * random.normal();
    if (quantize)
      d = std::round(d / kQuantum) * kQuantum;
    const double z = kFocalTimesBaseline / d;
    const double x = q.x() / q.z() + kSigmaPoint / 580.0 * random.normal();
    const double y = q.y() / q.z() + kSigmaPoint / 580.0 * random.normal();
    return {x * z, y * z, z};
  }

  RangeImage image_;
};

/// Twenty cases of a scene, every other one quantized; checks all that must be found.
void
checkScene(const std::string& name, bool has_planes)
{
  const SimulatedScene scene(name);
  Tally single("single", kSigmaDisparity), temporal("temporal", kSigmaDisparity),
      point("point", kSigmaPoint), quantum("quantum", kQuantum), fixed("fixed", 0.0),
      exponent("exponent", 0.0);
  for (std::uint64_t i = 0; i < 20; ++i) {
    test::Random random(i);
    const bool quantize = i % 2 == 1;
    const NoiseCalibration found =
        calibrateNoise(scene.frames(3, quantize, {}, random), optionsFor(Camera{}));
    ASSERT_EQ(found.status, NoiseCalibrationStatus::Ok);
    EXPECT_EQ(found.planes > 0, has_planes);
    EXPECT_EQ(found.quantum.isKnown(), quantize);
    const DisparitySigmas& sigmas = quantize ? found.before_rounding : found.sigmas;
    single.add(sigmas.single);
    temporal.add(sigmas.temporal);
    fixed.add(sigmas.fixed);
    point.add(found.sigma_point);
    exponent.add(found.depth_exponent);
    if (quantize)
      quantum.add(found.quantum);
  }
  // Curvature that adds a quarter to the variance of a spot, some of which noise may
  // have hidden, adds 1/256 of that to the variance of its tiles.
  single.expectRight(has_planes ? 0.0 : 0.125 / 256.0 * kSigmaDisparity);
  temporal.expectRight();
  point.expectRight();
  exponent.expectRight();
  fixed.expectCovered(); // being positive, it cannot be unbiased at zero
  quantum.expectUnbiased();
}

TEST(NoiseCalibration, FindsWhatWasPutIntoTheTable)
{
  checkScene("table", true);
}

TEST(NoiseCalibration, FindsWhatWasPutIntoTheRocks)
{
  checkScene("rocks", false);
}

TEST(NoiseCalibration, TellsTheFixedPatternFromNoise)
{
  constexpr double kPattern = 0.12;
  const SimulatedScene scene("table");
  Tally single("single", std::hypot(kSigmaDisparity, kPattern)),
      temporal("temporal", kSigmaDisparity), fixed("fixed", kPattern);
  for (std::uint64_t i = 0; i < 20; ++i) {
    test::Random random(i);
    const bool quantize = i % 2 == 1;
    const Field pattern = smoothField(640, 480, 3, kPattern, random);
    const NoiseCalibration found =
        calibrateNoise(scene.frames(3, quantize, pattern, random),
                       optionsFor(Camera{}));
    const DisparitySigmas& sigmas = quantize ? found.before_rounding : found.sigmas;
    single.add(sigmas.single);
    temporal.add(sigmas.temporal);
    fixed.add(sigmas.fixed);
    // Both come from the same residuals.
    EXPECT_NEAR(found.sigmas.fixed.value, found.fixed_from_difference.value, 1e-3);
  }
  single.expectRight();
  temporal.expectRight();
  fixed.expectRight();
}

TEST(NoiseCalibration, IntervalsHoldTheTruthInNineteenOfTwentyCases)
{
  constexpr int kTrials = 200;
  constexpr double kPattern = 0.1, kSigma = 0.06;
  int single = 0, temporal = 0, fixed = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    test::Random random(static_cast<std::uint64_t>(trial));
    // Wraps about the edges: as many independent pixels as its covariance says.
    const Field pattern = smoothField(160, 120, 1, kPattern, random);
    const NoiseCalibration found =
        calibrateNoise(planeFrames(4, kSigma, pattern, random),
                       optionsFor(smallCamera()));
    ASSERT_EQ(found.planes, 1);
    single += found.sigmas.single.contains(std::hypot(kPattern, kSigma));
    temporal += found.sigmas.temporal.contains(kSigma);
    fixed += found.sigmas.fixed.contains(kPattern);
  }
  RecordProperty("single", single);
  RecordProperty("temporal", temporal);
  RecordProperty("fixed", fixed);
  // The binomial standard deviation is 1.5 %; a jackknife over some forty cells may
  // lose another 2 %.
  for (const int hits : {single, temporal, fixed}) {
    EXPECT_GE(hits, 0.90 * kTrials);
    EXPECT_LE(hits, 0.995 * kTrials);
  }
}

TEST(NoiseCalibration, SmallRegionsTakeLongWavesIntoTheirPlanes)
{
  for (std::uint64_t i = 0; i < 5; ++i) {
    test::Random random(i);
    // Higher waves would bend so small a plane that it could be a curved surface.
    const Field waves = smoothField(160, 120, 15, 0.03, random);
    const std::vector<PointImage> frames = planeFrames(3, 0.01, waves, random);
    NoiseCalibrationOptions options = optionsFor(smallCamera());
    const NoiseCalibration found = calibrateNoise(frames, options);
    ASSERT_GE(found.by_region_size.size(), 4u);
    for (std::size_t k = 1; k < 3; ++k) // up to 32 px, the length of the waves
      EXPECT_GT(found.by_region_size[k].single.value,
                1.1 * found.by_region_size[k - 1].single.value);
    EXPECT_EQ(found.by_region_size.back().size_px, 0);
    EXPECT_EQ(found.by_region_size.back().single.value, found.sigmas.single.value);

    options.region_px = 16;
    const NoiseCalibration small = calibrateNoise(frames, options);
    EXPECT_EQ(small.region_px, 16);
    EXPECT_EQ(small.sigmas.single.value, found.by_region_size[1].single.value);
  }
}

TEST(NoiseCalibration, LeavesOutWhatMovedAndDropouts)
{
  test::Random random;
  std::vector<PointImage> frames = planeFrames(7, 0.05, {}, random);
  const Camera camera = smallCamera();
  for (std::size_t t = 0; t < frames.size(); ++t)
    for (std::size_t i = 0; i < frames[t].points.size(); ++i) {
      const auto u = static_cast<int>(i % 160), v = static_cast<int>(i / 160);
      Eigen::Vector3f& q = frames[t].points[i];
      if (t < 2 && u > 100 && v > 70) // a box stood here in two frames
        q = camera.backProject(u, v, 0.7).cast<float>();
      if (random.integer(0, 99) == 0) // flicker
        q *= 1.5F;
      if (random.integer(0, 49) == 0) // dropouts
        q.setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  const NoiseCalibration found = calibrateNoise(frames, optionsFor(camera));
  ASSERT_EQ(found.planes, 1);
  EXPECT_GT(found.pixels, 0.9 * 160 * 120);
  EXPECT_TRUE(isNear(found.sigmas.temporal, 0.05)) << found.sigmas.temporal.value;
  EXPECT_TRUE(isNear(found.sigmas.single, 0.05)) << found.sigmas.single.value;
}

/// Two frames of disparities with noise, rounded to steps of the disparity and then of
/// the depth; 0: none.
std::vector<PointImage>
steppedFrames(const std::function<double(int u, int v)>& disparity,
              double sigma,
              double quantum_px,
              double depth_step_m,
              test::Random& random)
{
  const auto toSteps = [](double value, double step) {
    return step > 0.0 ? std::round(value / step) * step : value;
  };
  std::vector<PointImage> frames;
  for (int t = 0; t < 2; ++t)
    frames.push_back(imageOf(smallCamera(), [&](int u, int v) {
      const double d = disparity(u, v) + sigma * random.normal();
      return kFocalTimesBaseline /
             toSteps(kFocalTimesBaseline / toSteps(d, quantum_px), depth_step_m);
    }));
  return frames;
}

TEST(NoiseCalibration, FindsStepsOfTheDisparity)
{
  for (const double quantum : {1.0, 0.5, 0.25, 0.125, 0.1, 1.0 / 16.0, 1.0 / 32.0})
    // In narrow steps, in wide ones, and where few values leave theirs.
    for (const double sigma : {2.0 * quantum, 0.5 * quantum, 0.1 * quantum}) {
      SCOPED_TRACE(quantum);
      SCOPED_TRACE(sigma);
      test::Random random;
      const NoiseCalibration found =
          calibrateNoise(steppedFrames(planeDisparity, sigma, quantum, 0.0, random),
                         optionsFor(smallCamera()));
      // Single precision of a depth of 1 m is 3e-6 px.
      EXPECT_NEAR(found.quantum.value, quantum, 1e-5 * quantum + 1e-6);
      EXPECT_TRUE(isNear(found.before_rounding.temporal, sigma))
          << found.before_rounding.temporal.value;
    }
}

TEST(NoiseCalibration, FindsStepsWithoutNoise)
{
  test::Random random;
  const NoiseCalibration found =
      calibrateNoise(steppedFrames(planeDisparity, 0.0, 0.125, 0.0, random),
                     optionsFor(smallCamera()));
  EXPECT_NEAR(found.quantum.value, 0.125, 1e-6);
  EXPECT_EQ(found.sigmas.temporal.value, 0.0);
  EXPECT_EQ(found.before_rounding.temporal.value, 0.0);
}

TEST(NoiseCalibration, FindsStepsBehindMillimetres)
{
  test::Random random;
  const NoiseCalibration found =
      calibrateNoise(steppedFrames(planeDisparity, 0.1, 0.125, 1e-3, random),
                     optionsFor(smallCamera()));
  // A millimetre, a third of a step, moves single values by some percent of a step, but
  // there are 300 of them.
  EXPECT_NEAR(found.quantum.value, 0.125, 1e-4);
}

/// A tilted plane between 0.6 and 1.4 m.
double
nearDisparity(int /*u*/, int v)
{
  return 32.0 + 43.0 / 119.0 * v;
}

TEST(NoiseCalibration, FindsStepsThatAreTheWiderOnesFarAway)
{
  // A millimetre is from a fifth of a step to a whole one.
  test::Random random;
  const NoiseCalibration found =
      calibrateNoise(steppedFrames(nearDisparity, 0.05, 0.125, 1e-3, random),
                     optionsFor(smallCamera()));
  EXPECT_NEAR(found.quantum.value, 0.125, 1e-4);
}

TEST(NoiseCalibration, RoundedDepthsAreNoStepOfTheDisparity)
{
  for (const auto& disparity : {planeDisparity, nearDisparity})
    for (const double sigma : {0.02, 0.1})
      for (const double depth_step : {0.0, 5e-3, 1e-3, 1e-4}) {
        SCOPED_TRACE(sigma);
        SCOPED_TRACE(depth_step);
        test::Random random;
        const NoiseCalibration found =
            calibrateNoise(steppedFrames(disparity, sigma, 0.0, depth_step, random),
                           optionsFor(smallCamera()));
        ASSERT_EQ(found.status, NoiseCalibrationStatus::Ok);
        EXPECT_FALSE(found.quantum.isKnown()) << found.quantum.value;
        EXPECT_FALSE(found.before_rounding.single.isKnown());
      }
}

TEST(NoiseCalibration, SaysNothingOfNoiseBehindTooFewSteps)
{
  test::Random random;
  // A wall seen from the front: one step, one depth.
  const auto wall = [](int u, int) { return 20.0 + 0.0005 * u; };
  const NoiseCalibration found =
      calibrateNoise(steppedFrames(wall, 0.04, 0.125, 0.0, random),
                     optionsFor(smallCamera()));
  EXPECT_EQ(found.planes, 1);
  EXPECT_TRUE(found.quantum.isKnown());
  EXPECT_TRUE(found.sigmas.single.isKnown());
  EXPECT_FALSE(found.before_rounding.single.isKnown());
  EXPECT_FALSE(found.depth_exponent.isKnown());
}

TEST(NoiseCalibration, AnyBaselineMeansTheSameDepths)
{
  test::Random random;
  const std::vector<PointImage> frames =
      steppedFrames(planeDisparity, 0.1, 0.125, 0.0, random);
  NoiseCalibrationOptions options = optionsFor(smallCamera());
  const NoiseCalibration found = calibrateNoise(frames, options);
  for (const double factor : {1e-3, 0.1, 1.1, 1e3}) { // 1e3: mm for m
    SCOPED_TRACE(factor);
    NoiseCalibrationOptions other = options;
    other.baseline_m *= factor;
    const NoiseCalibration scaled = calibrateNoise(frames, other);
    // Single precision of the disparities, 1e-5 of the step.
    EXPECT_EQ(scaled.pixels, found.pixels);
    for (const auto& [value, expected] :
         {std::pair(scaled.quantum, found.quantum),
          std::pair(scaled.sigmas.single, found.sigmas.single),
          std::pair(scaled.before_rounding.temporal, found.before_rounding.temporal)})
      EXPECT_NEAR(value.value, factor * expected.value, 1e-5 * factor);
  }
}

TEST(NoiseCalibration, PointsOnTheirRaysTellNothingAboutPointing)
{
  test::Random random;
  const NoiseCalibration found =
      calibrateNoise(planeFrames(1, 0.1, {}, random), optionsFor(smallCamera()));
  EXPECT_FALSE(found.sigma_point.isKnown());
}

TEST(NoiseCalibration, OneFrameHasNoTemporalPart)
{
  test::Random random;
  const NoiseCalibration found =
      calibrateNoise(planeFrames(1, 0.1, {}, random), optionsFor(smallCamera()));
  EXPECT_EQ(found.status, NoiseCalibrationStatus::Ok);
  EXPECT_TRUE(isNear(found.sigmas.single, 0.1)) << found.sigmas.single.value;
  EXPECT_FALSE(found.sigmas.temporal.isKnown());
  EXPECT_FALSE(found.sigmas.fixed.isKnown());
  EXPECT_FALSE(found.fixed_from_difference.isKnown());
}

TEST(NoiseCalibration, SeesNoiseThatGrowsWithTheDepth)
{
  Tally exponent("exponent", 1.0);
  for (std::uint64_t i = 0; i < 10; ++i) {
    test::Random random(i);
    std::vector<PointImage> frames;
    for (int t = 0; t < 3; ++t)
      frames.push_back(imageOf(smallCamera(), [&](int u, int v) {
        const double d = planeDisparity(u, v);
        return d + 0.1 * (40.0 / d) * random.normal();
      }));
    const NoiseCalibration found = calibrateNoise(frames, optionsFor(smallCamera()));
    exponent.add(found.depth_exponent);
    EXPECT_FALSE(found.depth_exponent.contains(0.0));
    EXPECT_LT(found.by_depth.front().sigmas.single.high,
              found.by_depth.back().sigmas.single.low);
  }
  exponent.expectCovered();
}

TEST(NoiseCalibration, SaysWhenThereIsNothingToMeasure)
{
  const Camera camera = smallCamera();
  const auto statusOf = [&](const std::function<double(int, int)>& disparity) {
    return calibrateNoise({imageOf(camera, disparity)}, optionsFor(camera)).status;
  };
  EXPECT_EQ(statusOf([](int, int) { return std::nan(""); }),
            NoiseCalibrationStatus::NothingStatic);
  test::Random random;
  EXPECT_EQ(statusOf([&](int u, int v) {
              // Waves of 40 px: no spot of 32 px is flat.
              return 40.0 + 2.0 * std::sin(u / 6.4) * std::sin(v / 6.4) +
                     0.05 * random.normal();
            }),
            NoiseCalibrationStatus::NothingFlat);
}

TEST(NoiseCalibration, RejectsMisuse)
{
  test::Random random;
  std::vector<PointImage> frames = planeFrames(2, 0.1, {}, random);
  const NoiseCalibrationOptions good = optionsFor(smallCamera());
  EXPECT_THROW(calibrateNoise({}, good), std::invalid_argument);
  for (const auto& change : std::vector<std::function<void(NoiseCalibrationOptions&)>>{
           [](auto& o) { o.baseline_m = 0.0; },
           [](auto& o) { o.focal_px = std::nan(""); },
           [](auto& o) { o.camera.fx = -1.0; },
           [](auto& o) { o.region_px = 12; },
           [](auto& o) { o.region_px = -8; }}) {
    NoiseCalibrationOptions options = good;
    change(options);
    EXPECT_THROW(calibrateNoise(frames, options), std::invalid_argument);
  }
  frames[1].width = 120;
  frames[1].height = 160;
  EXPECT_THROW(calibrateNoise(frames, good), std::invalid_argument);
  frames[1] = frames[0];
  frames[1].points.pop_back();
  EXPECT_THROW(calibrateNoise(frames, good), std::invalid_argument);
}

TEST(Rounding, VarianceIsThatOfSimulatedPairs)
{
  constexpr double kStep = 0.125;
  constexpr int kPairs = 400000;
  std::uint64_t number = 0;
  for (const double ratio : {0.02, 0.099, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0}) {
    SCOPED_TRACE(ratio);
    test::Random random(number++);
    const double sigma = ratio * kStep;
    double sum = 0.0, squares = 0.0;
    for (int i = 0; i < kPairs; ++i) {
      const double phase = random.uniform(0.0, kStep);
      const auto reported = [&] {
        return std::round((phase + sigma * random.normal()) / kStep) * kStep;
      };
      const double first = reported();
      const double half = 0.5 * std::pow(first - reported(), 2);
      sum += half;
      squares += half * half;
    }
    const double mean = sum / kPairs;
    const double error = std::sqrt((squares / kPairs - mean * mean) / kPairs);
    EXPECT_NEAR(roundedTemporalVariance(sigma, kStep), mean, 4.0 * error);
    EXPECT_NEAR(sigmaBeforeRounding(roundedTemporalVariance(sigma, kStep), kStep),
                sigma,
                1e-9);
  }
}

TEST(Rounding, LimitsAreKnown)
{
  EXPECT_EQ(sigmaBeforeRounding(0.0, 0.125), 0.0);
  // Both formulas meet where they take over from each other.
  EXPECT_NEAR(roundedTemporalVariance(0.1 - 1e-12, 1.0),
              roundedTemporalVariance(0.1 + 1e-12, 1.0),
              1e-11);
  // Sheppard's correction for wide noise.
  EXPECT_NEAR(roundedTemporalVariance(2.0, 1.0), 4.0 + 1.0 / 12.0, 1e-12);
}

}} // namespace holdfast
