#include <holdfast/sensor/pattern_map_calibration.h>

#include "support/correlated_field.h"
#include "support/disparity_image.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace holdfast { namespace {

using test::imageOf, test::kFocalTimesBaseline;

constexpr double kWhite = 0.05; // px
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

TEST(PatternMap, HasAnErrorForEachPixelOrNone)
{
  const PatternMap map(2, 3, {0.5F, -0.25F, 0.0F, kNaN, 1.0F, 2.0F});
  EXPECT_EQ(map.width(), 2);
  EXPECT_EQ(map.height(), 3);
  EXPECT_EQ(map.error(1), -0.25);
  EXPECT_EQ(map.error(3), 0.0);
  EXPECT_TRUE(std::isnan(map.errors()[3]));
  EXPECT_THROW(PatternMap(2, 2, {0.0F, 0.0F, 0.0F}), std::invalid_argument);
  EXPECT_THROW(PatternMap(0, 0, {}), std::invalid_argument);
  EXPECT_THROW(PatternMap(1, 1, {std::numeric_limits<float>::infinity()}),
               std::invalid_argument);
}

TEST(PatternMap, PointsMoveAlongTheirRaysByTheErrorOfTheDisparity)
{
  test::Random random;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d q(random.uniform(-1.0, 1.0),
                            random.uniform(-1.0, 1.0),
                            random.uniform(0.4, 5.0));
    const double error = random.uniform(-0.5, 0.5);
    const Eigen::Vector3d moved = withoutDisparityError(q, error, kFocalTimesBaseline);
    EXPECT_NEAR(kFocalTimesBaseline / moved.z(),
                kFocalTimesBaseline / q.z() - error,
                1e-12);
    EXPECT_LT(moved.cross(q).norm(), 1e-14);
  }
  // Nothing is left of a disparity of 43.5 px at 1 m.
  EXPECT_TRUE(
      withoutDisparityError({0.1, 0.0, 1.0}, 43.5, kFocalTimesBaseline).hasNaN());
}

/// A plane, tilted at random, with a pattern and white noise.
PoseFrames
randomPose(const std::vector<double>& pattern, test::Random& random)
{
  const Camera camera;
  const double level = random.uniform(35.0, 55.0);
  const double along_u = random.uniform(-0.02, 0.02);
  const double along_v = random.uniform(-0.04, 0.04);
  return {imageOf(camera, [&](int u, int v) {
    const auto i = static_cast<std::size_t>(v * camera.width + u);
    return level + along_u * (u - camera.cx) + along_v * (v - camera.cy) + pattern[i] +
           kWhite * random.normal();
  })};
}

double
rms(const std::vector<double>& values)
{
  double squares = 0.0;
  for (const double value : values)
    squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

class PatternMapCalibrationTest : public testing::Test {
protected:
  const NoisePattern truth_{{{0.1, 2.0, PatternShape::Exponential}}};
  const test::CorrelatedField field_{truth_, 640, 480, 100};
  test::Random random_;
  NoiseCalibrationOptions options_;
};

TEST_F(PatternMapCalibrationTest, TakesAwayWhatStaysWithThePixels)
{
  const std::vector<double> camera = field_.draw(random_);
  std::vector<PoseFrames> poses;
  for (int p = 0; p < 2; ++p)
    poses.push_back(randomPose(camera, random_));
  PatternMapCalibration found = calibratePatternMap(poses, options_);
  ASSERT_EQ(found.status, NoiseCalibrationStatus::Ok);
  ASSERT_NE(found.map, nullptr);
  EXPECT_GT(found.known_part, 0.95);
  EXPECT_NEAR(found.before_px, std::sqrt(0.01 + kWhite * kWhite), 0.003);
  // The best multiple of one other pose leaves U + S U / (S + U) of pattern S and white
  // noise U; some smoothing may help.
  const double one_pose = std::sqrt(0.0025 + 0.01 * 0.0025 / 0.0125);
  EXPECT_LT(found.after_px, 1.01 * one_pose);
  EXPECT_GT(found.after_px, kWhite);

  // What is left of the camera's own pattern, from both poses.
  std::vector<double> left;
  for (std::size_t i = 0; i < camera.size(); ++i)
    if (!std::isnan(found.map->errors()[i]))
      left.push_back(camera[i] - found.map->error(i));
  EXPECT_LT(rms(left), 0.4 * rms(camera));

  const PatternCalibration& rest = found.left;
  EXPECT_FALSE(rest.shared_part.isKnown());
  ASSERT_EQ(rest.status, NoiseCalibrationStatus::Ok);
  EXPECT_NEAR(rest.single.value, found.after_px, 0.05 * found.after_px);
  EXPECT_LT(rest.pattern().variance(), 0.3 * truth_.variance());
}

TEST_F(PatternMapCalibrationTest, MorePosesLeaveLess)
{
  const std::vector<double> camera = field_.draw(random_);
  std::vector<PoseFrames> poses;
  for (int p = 0; p < 4; ++p) {
    std::vector<double> sum = field_.draw(random_);
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += camera[i];
    poses.push_back(randomPose(sum, random_));
  }
  const double four = calibratePatternMap(poses, options_).after_px;
  poses.resize(2);
  const double two = calibratePatternMap(poses, options_).after_px;
  EXPECT_LT(four, 0.97 * two);
}

TEST_F(PatternMapCalibrationTest, OfSurfacesThatShareNothingThereIsNone)
{
  std::vector<PoseFrames> poses;
  for (int p = 0; p < 3; ++p)
    poses.push_back(randomPose(field_.draw(random_), random_));
  const PatternMapCalibration found = calibratePatternMap(poses, options_);
  ASSERT_NE(found.map, nullptr);
  EXPECT_LE(found.after_px, found.before_px * 1.001);
  std::vector<double> errors;
  for (std::size_t i = 0; i < found.map->errors().size(); ++i)
    errors.push_back(found.map->error(i));
  EXPECT_LT(rms(errors), 0.1 * found.before_px);
}

TEST_F(PatternMapCalibrationTest, NamesThePoseWithoutPlanesAndRejectsMisuse)
{
  const PoseFrames good = randomPose(field_.draw(random_), random_);
  const PoseFrames empty{imageOf(Camera{}, [](int, int) { return std::nan(""); })};
  const PatternMapCalibration found = calibratePatternMap({good, empty}, options_);
  EXPECT_EQ(found.status, NoiseCalibrationStatus::NothingStatic);
  EXPECT_EQ(found.pose, 1);
  EXPECT_EQ(found.map, nullptr);
  EXPECT_THROW(calibratePatternMap({good}, options_), std::invalid_argument);
  EXPECT_THROW(calibratePatternMap({}, options_), std::invalid_argument);
}

}} // namespace holdfast
