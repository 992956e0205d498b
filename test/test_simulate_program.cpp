#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/patch/surface.h>
#include <holdfast/simulation/scene.h>

#include "support/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;

class SimulateProgram : public testing::Test {
protected:
  SimulateProgram()
  : folder_(test::freshFolder(
        std::string("simulate_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  , cloud_(folder_ + "/cloud.pcd")
  {}

  test::ProgramRun simulate(Names arguments) const
  {
    arguments.insert(arguments.begin(), "simulate");
    return test::runProgram(folder_, arguments);
  }

  /// Runs it on a coarse grid into cloud_ and expects success.
  void make(const std::string& scene, const Names& more = {}) const
  {
    Names arguments{scene, "-o", cloud_, "--stride", "8"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const test::ProgramRun run = simulate(arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.err, "");
  }

  Json truth() const
  {
    return Json::parse(test::readFile(folder_ + "/cloud.truth.json"));
  }

  std::string folder_;
  std::string cloud_;
};

Eigen::Vector3d
pointOf(const RangeCloud& cloud, std::size_t i)
{
  return (*cloud.points)[i].getVector3fMap().cast<double>();
}

Patch
patchOf(const Json& json)
{
  const PatchType type{*surfaceFromName(json.at("surface").get<std::string>()),
                       *boundaryFromName(json.at("boundary").get<std::string>())};
  EXPECT_EQ(json.at("names").get<Names>(), parameterNames(type));
  EXPECT_EQ(json.at("dof").get<int>(), degreesOfFreedom(type));
  const auto values = json.at("parameters").get<std::vector<double>>();
  ParameterVector parameters(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), parameters.data());
  return unpack(type, parameters);
}

TEST_F(SimulateProgram, WithoutNoisePointsLieOnThePatchOfTheTruth)
{
  for (const PatchType& type : kPatchTypes) {
    std::string scene(surfaceName(type.surface));
    if (type.surface == SurfaceType::Plane)
      scene += "-" + std::string(boundaryName(type.boundary));
    SCOPED_TRACE(scene);
    make(scene, {"--noise-scale", "0"});
    const Json described = truth().at("patches");
    ASSERT_EQ(described.size(), 1u);
    const Patch patch = patchOf(described[0]);
    EXPECT_EQ(patch.type, type);
    const RangeCloud cloud = loadCloud(cloud_);
    EXPECT_EQ(cloud.points->width, 80u);
    EXPECT_EQ(cloud.points->height, 60u);
    int valid = 0;
    for (std::size_t i = 0; i < cloud.points->size(); ++i) {
      if (!std::isfinite((*cloud.points)[i].x))
        continue;
      ++valid;
      // Single precision of coordinates below 0.2 m, times two for f = -2 height.
      EXPECT_NEAR(implicitValue(patch, pointOf(cloud, i)), 0.0, 1e-7);
    }
    EXPECT_GT(valid, 50);
  }
}

TEST_F(SimulateProgram, TruthDescribesSensorAndScene)
{
  make("mix", {"--distance", "1.5", "--random-seed", "12", "--quantize"});
  const Json json = truth();
  EXPECT_EQ(json.at("cloud"), "cloud.pcd");
  EXPECT_EQ(json.at("scene"), "mix");
  EXPECT_EQ(json.at("random_seed"), 12);
  EXPECT_EQ(json.at("noise_scale"), 1.0);
  EXPECT_EQ(json.at("quantized"), true);
  EXPECT_EQ(json.at("stride"), 8);
  EXPECT_EQ(json.at("sensor").at("name"), "kinect_v1");
  EXPECT_TRUE(json.at("patches").empty());
  Names shapes;
  for (const Json& shape : json.at("shapes"))
    shapes.push_back(shape.at("shape"));
  EXPECT_EQ(shapes, (Names{"terrain", "box", "boulder", "boulder", "ball", "pipe"}));

  // The VIEWPOINT of the cloud is the pose in the truth and in the scene.
  const Pose pose = loadCloud(cloud_).sensor_pose;
  const Pose expected = makeScene("mix", 1.5).sensor_pose;
  // VIEWPOINT holds nine digits.
  EXPECT_NEAR((pose.c - expected.c).norm(), 0.0, 1e-7);
  EXPECT_NEAR((pose.R - expected.R).norm(), 0.0, 1e-6);
  const auto position = json.at("sensor").at("position").get<std::vector<double>>();
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(position[static_cast<std::size_t>(i)], expected.c[i]);
}

TEST_F(SimulateProgram, TruthTellsThePatternThatWasDrawn)
{
  const Sensor sensor = loadSensor("kinect_v1");
  ASSERT_FALSE(sensor.pattern.empty());
  make("ball", {"--random-seed", "5"});
  const std::string shared = test::readFile(cloud_);
  const Json waves = truth().at("sensor").at("pattern");
  ASSERT_EQ(waves.size(), sensor.pattern.waves.size());
  for (std::size_t i = 0; i < waves.size(); ++i) {
    EXPECT_EQ(waves[i].at("sigma"), sensor.pattern.waves[i].sigma);
    EXPECT_EQ(waves[i].at("length_px"), sensor.pattern.waves[i].length_px / 8);
  }
  EXPECT_EQ(waves[0].at("shape"), "exponential");
  EXPECT_EQ(waves[1].at("shape"), "exponential");

  make("ball", {"--random-seed", "5", "--no-pattern"});
  EXPECT_EQ(truth().at("sensor").at("pattern"), Json::array());
  const std::string independent = test::readFile(cloud_);
  EXPECT_NE(independent, shared);
  // As from a file without one.
  const std::string file = folder_ + "/plain.yaml";
  const std::string text =
      test::readFile(HOLDFAST_SOURCE_DIR "/config/sensors/kinect_v1.yaml");
  std::ofstream(file) << text.substr(0, text.find("\n  pattern:") + 1);
  make("ball", {"--random-seed", "5", "--sensor", file});
  EXPECT_EQ(test::readFile(cloud_), independent);
}

TEST_F(SimulateProgram, PointsProjectToTheirPixels)
{
  make("rocks", {"--noise-scale", "0", "--sensor", "xtion"});
  const RangeCloud cloud = loadCloud(cloud_);
  const Json camera = truth().at("sensor").at("camera");
  Camera strided;
  strided.fx = camera.at("fx");
  strided.fy = camera.at("fy");
  strided.cx = camera.at("cx");
  strided.cy = camera.at("cy");
  EXPECT_DOUBLE_EQ(strided.fx, 525.0 / 8.0);
  const auto width = static_cast<std::size_t>(cloud.points->width);
  for (std::size_t i = 0; i < cloud.points->size(); ++i) {
    const Eigen::Vector3d q = cloud.sensor_pose.toLocal(pointOf(cloud, i));
    const Eigen::Vector2d pixel(static_cast<double>(i % width),
                                static_cast<double>(i / width));
    // Single precision of points and pose, times 66 px.
    EXPECT_NEAR((strided.project(q) - pixel).norm(), 0.0, 1e-3);
  }
}

TEST_F(SimulateProgram, CovarianceFieldIsTheNoiseThatWasDrawn)
{
  make("sphere", {"--covariance", "--noise-scale", "0.5"});
  const RangeCloud cloud = loadCloud(cloud_);
  ASSERT_TRUE(cloud.covariances);
  ASSERT_EQ(cloud.covariances->size(), cloud.points->size());
  EXPECT_EQ(countInvalidCovariances(cloud), 0);
  for (std::size_t i = 0; i < cloud.points->size(); ++i) {
    if (!std::isfinite((*cloud.points)[i].x))
      continue;
    const Eigen::Vector3f ray = cloud.sensor_pose.R.col(2).cast<float>();
    // Depth sigma at 1 m and half the noise: 0.5 * 3.9 mm; the ball is 0.1 m around.
    EXPECT_NEAR(std::sqrt(ray.dot((*cloud.covariances)[i] * ray)),
                0.5 * 3.9e-3,
                0.5e-3);
  }
  make("sphere");
  EXPECT_FALSE(loadCloud(cloud_).hasCovariances());
}

TEST_F(SimulateProgram, SameSeedSameFile)
{
  make("ball", {"--random-seed", "5"});
  const std::string first = test::readFile(cloud_);
  make("ball", {"--random-seed", "5"});
  EXPECT_EQ(test::readFile(cloud_), first);
  make("ball", {"--random-seed", "6"});
  EXPECT_NE(test::readFile(cloud_), first);
}

TEST_F(SimulateProgram, TextHoldsTheSamePoints)
{
  make("table");
  const RangeCloud binary = loadCloud(cloud_);
  make("table", {"--ascii"});
  EXPECT_NE(test::readFile(cloud_).find("DATA ascii"), std::string::npos);
  const RangeCloud text = loadCloud(cloud_);
  ASSERT_EQ(text.points->size(), binary.points->size());
  for (std::size_t i = 0; i < text.points->size(); ++i) {
    if (std::isfinite((*binary.points)[i].x)) {
      EXPECT_EQ(pointOf(text, i), pointOf(binary, i));
    }
  }
}

TEST_F(SimulateProgram, FailsWithOneLineAndNoFile)
{
  struct Case {
    Names arguments;
    int exit_code;
    std::string word;
  };
  const std::vector<Case> cases{
      {{"moon", "-o", cloud_}, 2, "moon"},
      {{"rocks"}, 2, "--output"},
      {{"-o", cloud_}, 2, "SCENE"},
      {{"rocks", "-o", folder_ + "/cloud.ply"}, 2, "PCD"},
      {{"rocks", "-o", cloud_, "--distance", "0"}, 2, "--distance"},
      {{"rocks", "-o", cloud_, "--distance", "near"}, 2, "--distance"},
      {{"rocks", "-o", cloud_, "--stride", "0"}, 2, "--stride"},
      {{"rocks", "-o", cloud_, "--noise-scale", "-1"}, 2, "--noise-scale"},
      {{"rocks", "-o", cloud_, "--noise-scale", "nan"}, 2, "--noise-scale"},
      {{"rocks", "-o", cloud_, "--distance", "inf"}, 2, "--distance"},
      {{"rocks", "-o", cloud_, "--random-seed", "-1"}, 2, "--random-seed"},
      {{"rocks", "-o", cloud_, "--sensor", "perfect", "--quantize"}, 2, "--quantize"},
      {{"rocks", "-o", cloud_, "--sensor", "nope"}, 1, "nope"},
      {{"rocks", "-o", folder_ + "/none/cloud.pcd"}, 1, "none/cloud.pcd"},
      {{"sphere", "-o", cloud_, "--distance", "50"}, 1, "range"},
  };
  for (const Case& c : cases) {
    const test::ProgramRun run = simulate(c.arguments);
    SCOPED_TRACE(run.err);
    EXPECT_EQ(run.exit_code, c.exit_code);
    EXPECT_EQ(run.errorLines(), 1);
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find(c.word), std::string::npos) << c.word;
    EXPECT_EQ(test::filesIn(folder_), Names{});
  }
}

TEST_F(SimulateProgram, NoCloudIsLeftWithoutItsTruth)
{
  const std::string truth = folder_ + "/cloud.truth.json";
  std::filesystem::create_directories(truth); // where the file should go
  const test::ProgramRun run = simulate({"ball", "-o", cloud_, "--stride", "8"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.errorLines(), 1) << run.err;
  EXPECT_EQ(test::filesIn(folder_), Names{"cloud.truth.json"});
}

}} // namespace holdfast
