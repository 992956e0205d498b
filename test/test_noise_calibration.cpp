#include <holdfast/sensor/noise_calibration.h>
#include <holdfast/sensor/simulator.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast { namespace {

constexpr double kFocalTimesBaseline = 580.0 * 0.075; // px m

/// As kinect_v1.yaml.
Sensor
kinect()
{
  Sensor sensor;
  sensor.name = "kinect";
  sensor.noise = std::make_shared<StereoNoiseModel>(StereoNoiseModel::Parameters{});
  sensor.min_range_m = 0.5;
  sensor.max_range_m = 8.0;
  sensor.disparity_quantum_px = 0.125;
  return sensor;
}

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

/// A point image from a disparity of each pixel, on the ray grid.
PointImage
imageOf(const Camera& camera, const std::function<double(int u, int v)>& disparity)
{
  PointImage image{camera.width, camera.height, {}};
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      image.points.push_back(
          camera.backProject(u, v, kFocalTimesBaseline / disparity(u, v))
              .cast<float>());
  return image;
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

/// Estimates of one figure with different seeds.
class Tally {
public:
  Tally(std::string name, double truth) : name_(std::move(name)), truth_(truth) {}

  void add(const Estimate& estimate)
  {
    values_.push_back(estimate.value);
    hits_ += estimate.contains(truth_);
  }

  /// With 95 % intervals, fewer than 8 of 10 have probability 0.012.
  void expectCovered() const
  {
    EXPECT_EQ(values_.size(), 10u);
    EXPECT_GE(hits_, 8) << name_;
  }

  /// Of the mean of ten, four standard errors are exceeded with probability 0.003.
  void expectUnbiased() const
  {
    const auto n = static_cast<double>(values_.size());
    double mean = 0.0, squares = 0.0;
    for (const double value : values_)
      mean += value / n;
    for (const double value : values_)
      squares += std::pow(value - mean, 2);
    const double error = std::sqrt(squares / (n - 1.0) / n);
    // 1e-6: the step is found exactly, but for the single precision of the points.
    EXPECT_NEAR(mean, truth_, 4.0 * error + 1e-6) << name_;
  }

  void expectRight() const
  {
    expectCovered();
    expectUnbiased();
  }

private:
  std::string name_;
  double truth_;
  std::vector<double> values_;
  int hits_ = 0;
};

/// Frames of a simulated scene, each time with fresh noise.
class SimulatedScene {
public:
  SimulatedScene(const std::string& scene, bool quantize)
  : sensor_(kinect()), quantize_(quantize)
  {
    image_ = castRays(makeScene(scene),
                      pixelRays(sensor_.camera),
                      sensor_.min_range_m,
                      sensor_.max_range_m);
    attachNoise(image_, *sensor_.noise);
  }

  /// \param pattern added to the disparities before they are rounded, if not empty.
  std::vector<PointImage> frames(int count, const Field& pattern, test::Random& random)
  {
    std::vector<PointImage> frames;
    for (int t = 0; t < count; ++t) {
      drawNoise(image_.truth, image_.roots, random.engine(), image_.points);
      addPattern(pattern);
      if (quantize_)
        quantizeDisparity(image_, sensor_);
      PointImage& frame = frames.emplace_back();
      frame.width = image_.width;
      frame.height = image_.height;
      for (const Eigen::Vector3d& q : image_.points)
        frame.points.push_back(image_.sensor_pose.toLocal(q).cast<float>());
    }
    return frames;
  }

  NoiseCalibrationOptions options() const
  {
    return optionsFor(sensor_.camera);
  }

private:
  void addPattern(const Field& pattern)
  {
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const Eigen::Vector3d q = image_.sensor_pose.toLocal(image_.points[i]);
      const double d = kFocalTimesBaseline / q.z();
      image_.points[i] = image_.sensor_pose.toWorld(q * (d / (d + pattern[i])));
    }
  }

  Sensor sensor_;
  bool quantize_;
  RangeImage image_;
};

constexpr double kSigmaDisparity = 0.17; // what the simulated sensor has, px
constexpr double kSigmaPoint = 0.35;

/// Ten seeds of a scene; checks all that must be found in any.
void
checkScene(const std::string& name, bool quantize, bool has_planes)
{
  SimulatedScene scene(name, quantize);
  Tally single("single", kSigmaDisparity), temporal("temporal", kSigmaDisparity),
      point("point", kSigmaPoint), quantum("quantum", 0.125), fixed("fixed", 0.0),
      exponent("exponent", 0.0);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    test::Random random(seed);
    const NoiseCalibration found =
        calibrateNoise(scene.frames(3, {}, random), scene.options());
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
  single.expectRight();
  temporal.expectRight();
  point.expectRight();
  exponent.expectRight();
  fixed.expectCovered(); // being positive, it cannot be unbiased at zero
  if (quantize)
    quantum.expectUnbiased();
}

TEST(NoiseCalibration, FindsWhatWasPutIntoATable)
{
  checkScene("table", false, true);
}

TEST(NoiseCalibration, FindsWhatWasPutIntoAQuantizedTable)
{
  checkScene("table", true, true);
}

TEST(NoiseCalibration, FindsWhatWasPutIntoRocks)
{
  checkScene("rocks", false, false);
}

TEST(NoiseCalibration, FindsWhatWasPutIntoQuantizedRocks)
{
  checkScene("rocks", true, false);
}

TEST(NoiseCalibration, TellsAFixedPatternFromNoise)
{
  constexpr double kPattern = 0.12;
  for (const bool quantize : {false, true}) {
    SCOPED_TRACE(quantize);
    SimulatedScene scene("table", quantize);
    Tally single("single", std::hypot(kSigmaDisparity, kPattern)),
        temporal("temporal", kSigmaDisparity), fixed("fixed", kPattern);
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      test::Random random(seed);
      const Field pattern = smoothField(640, 480, 3, kPattern, random);
      const NoiseCalibration found =
          calibrateNoise(scene.frames(3, pattern, random), scene.options());
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
}

TEST(NoiseCalibration, IntervalsCoverInNineteenOfTwentyCases)
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
  test::Random random;
  const Field pattern = smoothField(160, 120, 15, 0.2, random);
  const NoiseCalibration found =
      calibrateNoise(planeFrames(3, 0.05, pattern, random), optionsFor(smallCamera()));
  ASSERT_GE(found.by_region_size.size(), 4u);
  for (std::size_t i = 1; i < 3; ++i) // up to 32 px, the length of the waves
    EXPECT_GT(found.by_region_size[i].single.value,
              1.1 * found.by_region_size[i - 1].single.value);
  EXPECT_EQ(found.by_region_size.back().size_px, 0);
  EXPECT_EQ(found.by_region_size.back().single.value, found.sigmas.single.value);

  NoiseCalibrationOptions options = optionsFor(smallCamera());
  options.region_px = 16;
  test::Random again;
  const Field same = smoothField(160, 120, 15, 0.2, again);
  const NoiseCalibration small =
      calibrateNoise(planeFrames(3, 0.05, same, again), options);
  EXPECT_EQ(small.region_px, 16);
  EXPECT_EQ(small.sigmas.single.value, found.by_region_size[1].single.value);
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
  EXPECT_TRUE(found.sigmas.temporal.contains(0.05)) << found.sigmas.temporal.value;
  EXPECT_TRUE(found.sigmas.single.contains(0.05)) << found.sigmas.single.value;
  EXPECT_EQ(found.sigmas.fixed.low, 0.0);
}

/// The plane with steps of the disparity and of the depth; 0: none.
std::vector<PointImage>
steppedFrames(double quantum_px, double depth_step_m, test::Random& random)
{
  const auto toSteps = [](double value, double step) {
    return step > 0.0 ? std::round(value / step) * step : value;
  };
  std::vector<PointImage> frames;
  for (int t = 0; t < 2; ++t)
    frames.push_back(imageOf(smallCamera(), [&](int u, int v) {
      const double d = planeDisparity(u, v) + 0.1 * random.normal();
      return kFocalTimesBaseline /
             toSteps(kFocalTimesBaseline / toSteps(d, quantum_px), depth_step_m);
    }));
  return frames;
}

TEST(NoiseCalibration, FindsStepsOfTheDisparity)
{
  for (const double quantum : {0.25, 0.125, 0.1, 1.0 / 16.0, 1.0 / 32.0}) {
    SCOPED_TRACE(quantum);
    test::Random random;
    const NoiseCalibration found =
        calibrateNoise(steppedFrames(quantum, 0.0, random), optionsFor(smallCamera()));
    // Single precision of a depth of 1 m is 3e-6 px.
    EXPECT_NEAR(found.quantum.value, quantum, 1e-5 * quantum);
    EXPECT_TRUE(found.before_rounding.temporal.contains(0.1));
  }
}

TEST(NoiseCalibration, FindsStepsBehindMillimetres)
{
  test::Random random;
  const NoiseCalibration found =
      calibrateNoise(steppedFrames(0.125, 1e-3, random), optionsFor(smallCamera()));
  // A millimetre, a third of a step, moves single values by some percent of a step, but
  // there are 300 of them.
  EXPECT_NEAR(found.quantum.value, 0.125, 1e-4);
  EXPECT_TRUE(found.quantum.contains(0.125))
      << found.quantum.low << ' ' << found.quantum.high;
}

TEST(NoiseCalibration, RoundedDepthsAreNoStepOfTheDisparity)
{
  for (const double depth_step : {0.0, 1e-3, 1e-4}) {
    SCOPED_TRACE(depth_step);
    test::Random random;
    const NoiseCalibration found =
        calibrateNoise(steppedFrames(0.0, depth_step, random),
                       optionsFor(smallCamera()));
    EXPECT_FALSE(found.quantum.isKnown()) << found.quantum.value;
    EXPECT_FALSE(found.before_rounding.single.isKnown());
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
  EXPECT_TRUE(found.sigmas.single.contains(0.1)) << found.sigmas.single.value;
  EXPECT_FALSE(found.sigmas.temporal.isKnown());
  EXPECT_FALSE(found.sigmas.fixed.isKnown());
  EXPECT_FALSE(found.fixed_from_difference.isKnown());
}

TEST(NoiseCalibration, SeesNoiseThatGrowsWithTheDepth)
{
  Tally exponent("exponent", 1.0);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    test::Random random(seed);
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
  constexpr double kQuantum = 0.125;
  constexpr int kPairs = 400000;
  std::uint64_t number = 0;
  for (const double ratio : {0.02, 0.099, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0}) {
    SCOPED_TRACE(ratio);
    test::Random random(number++);
    const double sigma = ratio * kQuantum;
    double sum = 0.0, squares = 0.0;
    for (int i = 0; i < kPairs; ++i) {
      const double phase = random.uniform(0.0, kQuantum);
      const auto reported = [&] {
        return std::round((phase + sigma * random.normal()) / kQuantum) * kQuantum;
      };
      const double first = reported();
      const double half = 0.5 * std::pow(first - reported(), 2);
      sum += half;
      squares += half * half;
    }
    const double mean = sum / kPairs;
    const double error = std::sqrt((squares / kPairs - mean * mean) / kPairs);
    EXPECT_NEAR(roundedTemporalVariance(sigma, kQuantum), mean, 4.0 * error);
    EXPECT_NEAR(sigmaBeforeRounding(roundedTemporalVariance(sigma, kQuantum), kQuantum),
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
