#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include "support/organized_cloud.h"
#include "support/random.h"
#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace holdfast { namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;
using test::ProgramRun;

bool
contains(const Json& estimate, double value)
{
  return estimate.at("interval").at(0) <= value &&
         estimate.at("interval").at(1) >= value;
}

class CalibrateProgram : public testing::Test {
protected:
  CalibrateProgram()
  : folder_(test::freshFolder(
        std::string("calibrate_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  {}

  ProgramRun calibrate(Names arguments) const
  {
    arguments.insert(arguments.begin(), "calibrate");
    return test::runProgram(folder_, arguments);
  }

  /// Frames of a table as a Kinect sees it, were its errors independent: a pattern
  /// would be another in every frame.
  Names simulate(int frames) const
  {
    Names paths;
    for (int i = 1; i <= frames; ++i) {
      paths.push_back(folder_ + "/frame" + std::to_string(i) + ".pcd");
      const ProgramRun run = test::runProgram(folder_,
                                              {"simulate",
                                               "table",
                                               "-o",
                                               paths.back(),
                                               "--quantize",
                                               "--no-pattern",
                                               "--random-seed",
                                               std::to_string(i)});
      EXPECT_EQ(run.exit_code, 0) << run.err;
    }
    return paths;
  }

  /// Expects exit code and one line, nothing on standard output and no file.
  void expectError(int exit_code, Names arguments, const std::string& what) const
  {
    const std::string out = folder_ + "/out";
    arguments.insert(arguments.end(), {"-o", out + ".yaml", "--json", out + ".json"});
    const ProgramRun run = calibrate(arguments);
    SCOPED_TRACE(run.err);
    EXPECT_EQ(run.exit_code, exit_code);
    EXPECT_EQ(run.errorLines(), 1);
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find(what), std::string::npos) << what;
    EXPECT_FALSE(std::filesystem::exists(out + ".yaml"));
    EXPECT_FALSE(std::filesystem::exists(out + ".json"));
  }

  std::string folder_;
};

TEST_F(CalibrateProgram, FindsTheSimulatedKinectAndWritesIt)
{
  const std::string sensor_path = folder_ + "/mine.yaml";
  Names arguments = simulate(3);
  const std::string cloud = arguments.front();
  arguments.insert(arguments.end(),
                   {"-o", sensor_path, "--plot", folder_ + "/plot.svg", "--json", "-"});
  const ProgramRun run = calibrate(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["frames"], 3);
  // What kinect_v1.yaml says was simulated.
  EXPECT_TRUE(contains(json["before_rounding_px"]["single_frame"], 0.17)) << run.out;
  EXPECT_TRUE(contains(json["before_rounding_px"]["temporal"], 0.17)) << run.out;
  EXPECT_TRUE(contains(json["sigma_point_px"], 0.35)) << run.out;
  EXPECT_NEAR(json["quantum_px"]["value"], 0.125, 1e-6);

  const Sensor sensor = loadSensor(sensor_path);
  EXPECT_EQ(sensor.name, "mine");
  EXPECT_EQ(sensor.camera.fx, 575.8);
  const auto noise = std::dynamic_pointer_cast<const StereoNoiseModel>(sensor.noise);
  ASSERT_NE(noise, nullptr);
  // Five digits are written.
  EXPECT_NEAR(noise->parameters().sigma_disparity_px,
              json["sigma_disparity_px"]["single_frame"]["value"],
              1e-5);
  EXPECT_NEAR(sensor.disparity_quantum_px, 0.125, 1e-5);
  EXPECT_EQ(test::readFile(folder_ + "/plot.svg").rfind("<svg", 0), 0U);

  const ProgramRun fit = test::runProgram(
      folder_,
      {"fit", cloud, "--sensor", sensor_path, "--seeds", "20", "--json", "-"});
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
}

TEST_F(CalibrateProgram, TablesAndSentences)
{
  const Names frame = simulate(1);
  const ProgramRun run = calibrate(frame);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const std::string words : {"640 x 480",
                                  "whole planes",
                                  "squares of 32 px",
                                  "95 % interval",
                                  "One frame",
                                  "1/8 px.",
                                  "The disparity noise is the same at all depths"})
    EXPECT_NE(run.out.find(words), std::string::npos) << words << '\n' << run.out;

  const ProgramRun small = calibrate({frame.front(), "--region", "32"});
  EXPECT_NE(small.out.find("in a frame, about squares of 32 px"), std::string::npos)
      << small.out;
}

TEST_F(CalibrateProgram, HelpTeaches)
{
  const ProgramRun run = calibrate({"--help"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.out.find("Examples:"), std::string::npos);
  EXPECT_NE(run.out.find("--sensor mine.yaml"), std::string::npos);
  EXPECT_NE(run.out.find("--pose second/"), std::string::npos);
}

TEST_F(CalibrateProgram, UsageErrorsExitWithTwo)
{
  const std::string cloud = folder_ + "/cloud.pcd";
  saveCloud(cloud, test::bowlCloud(40, 30));
  expectError(2, {}, "CLOUD");
  expectError(2, {cloud, "--sensor", "no_such_sensor"}, "no_such_sensor");
  expectError(2, {cloud, "--plot", folder_ + "/plot.png"}, "SVG");
  for (const std::string region : {"0", "12", "-8", "all"})
    expectError(2, {cloud, "--region", region}, "--region");
}

TEST_F(CalibrateProgram, BadFramesAreNamed)
{
  const std::string base = folder_ + "/";
  const Camera camera = test::makeCamera(160, 120, 575.8);
  const auto waves = [](int u, int v) {
    return 1.0 + 0.05 * std::sin(u / 5.0) * std::sin(v / 5.0);
  };
  saveCloud(base + "waves.pcd", test::makeOrganizedCloud(camera, waves));
  saveCloud(base + "small.pcd", test::bowlCloud(40, 30));
  test::writeFile(base + "loose.ply",
                  test::plyBytes<float>(test::bowlCloud(40, 30), "ascii"));
  test::writeFile(base + "nan.pcd",
                  test::pcdHeader(test::kXyzFields, 2, 2, "ascii") +
                      "nan nan nan\nnan nan nan\nnan nan nan\nnan nan nan\n");
  expectError(1, {base + "missing.pcd"}, "missing.pcd: no such file");
  expectError(1, {base + "nan.pcd"}, "nan.pcd: has no valid point");
  expectError(1, {base + "loose.ply"}, "loose.ply: not organized");
  expectError(1,
              {base + "waves.pcd", base + "small.pcd"},
              "small.pcd: 40 x 30 pixels, where " + base + "waves.pcd has 160 x 120");
  expectError(1, {base + "waves.pcd"}, "waves.pcd: nothing large and flat");
  const auto wall = [](int u, int v) { return 1.0 / (1.0 + 1e-3 * u + 1e-3 * v); };
  saveCloud(base + "wall.pcd", test::makeOrganizedCloud(camera, wall));
  saveCloud(base + "tele.pcd",
            test::makeOrganizedCloud(test::makeCamera(160, 120, 800.0), wall));
  const auto before = [](int u, int v) { return 0.5 / (1.0 + 1e-3 * u + 1e-3 * v); };
  saveCloud(base + "before.pcd", test::makeOrganizedCloud(camera, before));
  expectError(1,
              {base + "wall.pcd", base + "tele.pcd"},
              "tele.pcd: taken by another camera");
  expectError(1,
              {base + "wall.pcd", "--pose", base + "tele.pcd"},
              "tele.pcd: taken by another camera");
  expectError(
      1,
      {base + "wall.pcd", "--pose", base + "wall.pcd", "--pose", base + "small.pcd"},
      "small.pcd: 40 x 30 pixels, where " + base + "wall.pcd has 160 x 120");
  expectError(1,
              {base + "wall.pcd", "--pose", base + "waves.pcd"},
              "waves.pcd: nothing large and flat");
  expectError(1, {base + "wall.pcd", "--pose", base + "missing.pcd"}, "missing.pcd");
  expectError(1,
              {base + "wall.pcd", base + "before.pcd", base + "waves.pcd"},
              "wall.pcd and 2 more: nothing "); // rests, or is flat in the mean
  expectError(1, {base + "small.pcd"}, "small.pcd: nothing large and flat");
}

/// Three walls with the same errors of the pixels, and white noise; a map and a sensor
/// file from the first two.
class CalibratedMap : public CalibrateProgram {
protected:
  CalibratedMap()
  {
    for (int i = 0; i < 160 * 120; ++i)
      fixed_.push_back(0.2 * random_.normal());
    saveWall("/wall.pcd", 0.01, 0.02);
    saveWall("/other.pcd", -0.02, 0.01);
    saveWall("/third.pcd", 0.0, -0.01);
    std::filesystem::create_directory(folder_ + "/maps");
    run_ = calibrate({folder_ + "/wall.pcd",
                      "--pose",
                      folder_ + "/other.pcd",
                      "--map",
                      folder_ + "/maps/mine.png",
                      "-o",
                      sensor_,
                      "--json",
                      "-",
                      "--quiet"});
  }

  void saveWall(const std::string& name, double du, double dv)
  {
    const auto depth = [&](int u, int v) {
      const double d = 43.5 + du * u + dv * v +
                       fixed_[static_cast<std::size_t>(v * 160 + u)] +
                       0.05 * random_.normal();
      return 43.5 / d;
    };
    const Camera camera = test::makeCamera(160, 120, 575.8);
    saveCloud(folder_ + name, test::makeOrganizedCloud(camera, depth));
  }

  /// chi2 over its degrees of freedom of the plane through a wall.
  double chi2Ratio(const std::string& wall, const Names& more) const
  {
    Names arguments{"fit",
                    folder_ + wall,
                    "--sensor",
                    sensor_,
                    "--whole",
                    "--accept",
                    "all",
                    "--json",
                    "-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramRun fit = test::runProgram(folder_, arguments);
    EXPECT_EQ(fit.exit_code, 0) << fit.err;
    const Json patch = Json::parse(fit.out)["patches"][0];
    return patch["chi2"].get<double>() / patch["chi2_dof"].get<double>();
  }

  test::Random random_;
  std::vector<double> fixed_;
  const std::string sensor_ = folder_ + "/mine.yaml";
  ProgramRun run_;
};

TEST_F(CalibratedMap, SaysWhatItTookDown)
{
  ASSERT_EQ(run_.exit_code, 0) << run_.err;
  const Json found = Json::parse(run_.out)["pattern_map"];
  EXPECT_NEAR(found["rms_before_px"], std::hypot(0.2, 0.05), 0.005);
  EXPECT_LT(found["rms_after_px"], 0.08);
  EXPECT_EQ(found["smoothing_px"], 0.0);
  EXPECT_NE(test::readFile(sensor_).find("pattern_map: maps/mine.png"),
            std::string::npos);
  EXPECT_NEAR(dynamic_cast<const StereoNoiseModel&>(*loadSensor(sensor_).noise)
                  .parameters()
                  .sigma_disparity_px,
              found["rms_after_px"],
              0.01);
}

// What is left of a wall it has not seen agrees with what the sensor file promises.
TEST_F(CalibratedMap, FitSubtractsIt)
{
  ASSERT_EQ(run_.exit_code, 0) << run_.err;
  EXPECT_LT(chi2Ratio("/third.pcd", {}), 1.5);
  EXPECT_GT(chi2Ratio("/third.pcd", {"--no-pattern"}), 3.0);
  const ProgramRun info =
      test::runProgram(folder_, {"info", folder_ + "/third.pcd", "--sensor", sensor_});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE((info.out + info.err).find("less the pattern map"), std::string::npos)
      << info.out << info.err;
}

TEST_F(CalibratedMap, IsForCloudsOfItsSize)
{
  ASSERT_EQ(run_.exit_code, 0) << run_.err;
  saveCloud(folder_ + "/small.pcd", test::bowlCloud(40, 30));
  for (const std::string program : {"fit", "info"}) {
    const ProgramRun small =
        test::runProgram(folder_,
                         {program, folder_ + "/small.pcd", "--sensor", sensor_});
    EXPECT_EQ(small.exit_code, 1);
    EXPECT_EQ(small.errorLines(), 1) << small.err;
    EXPECT_NE(small.err.find("small.pcd: 40 x 30 pixels, where the pattern map of the "
                             "sensor mine has 160 x 120"),
              std::string::npos)
        << small.err;
  }
}

TEST_F(CalibrateProgram, AMapWantsSeveralPoses)
{
  const std::string cloud = folder_ + "/cloud.pcd", map = folder_ + "/map.png";
  saveCloud(cloud, test::bowlCloud(40, 30));
  expectError(2, {cloud, "--map", map}, "--pose");
  expectError(2, {cloud, "--pose", cloud, "--map", folder_ + "/map.jpg"}, "PNG");
  EXPECT_FALSE(std::filesystem::exists(map));
}

TEST_F(CalibrateProgram, UnwritableOutput)
{
  const Names frame = simulate(1);
  for (const std::string option : {"-o", "--json", "--plot"}) {
    const ProgramRun run =
        calibrate({frame.front(), option, folder_ + "/none/result.svg"});
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_EQ(run.errorLines(), 1) << run.err;
    EXPECT_NE(run.err.find("none/result.svg"), std::string::npos) << run.err;
  }
}

TEST_F(CalibrateProgram, RecordedTableHasItsKnownNoise)
{
  Names arguments;
  for (const int frame : {17, 18, 19, 20, 22})
    arguments.push_back(
        test::recordedCloud("mosd_static_learn" + std::to_string(frame) + ".pcd"));
  if (std::count(arguments.begin(), arguments.end(), "") > 0)
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  arguments.insert(arguments.end(), {"--sensor", "xtion", "--json", "-"});
  const ProgramRun run = calibrate(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["planes"], 1);
  // Measured independently, on all pixels that a plane fitted to the table by hand has
  // within half a pixel of disparity.
  EXPECT_TRUE(contains(json["sigma_disparity_px"]["temporal"], 0.052)) << run.out;
  EXPECT_TRUE(contains(json["sigma_disparity_px"]["single_frame"], 0.138)) << run.out;
  EXPECT_NEAR(json["sigma_disparity_px"]["temporal"]["value"], 0.052, 0.003);
  EXPECT_NEAR(json["sigma_disparity_px"]["single_frame"]["value"], 0.138, 0.01);
  // 1/8 px in units of a nominal f b that is one percent off.
  EXPECT_NEAR(json["quantum_px"]["value"], 0.125, 0.01 * 0.125);
  EXPECT_TRUE(json["sigma_point_px"].is_null());
  // Small regions see half of it.
  EXPECT_NEAR(json["by_region_size"][2]["single_frame"]["value"], 0.09, 0.005);
  EXPECT_EQ(json["by_region_size"][2]["size_px"], 32);
}

TEST_F(CalibrateProgram, MapOfOneRecordedPoseHelpsAnother)
{
  Names arguments;
  for (const int frame : {17, 18, 19, 20, 22})
    arguments.push_back(
        test::recordedCloud("mosd_static_learn" + std::to_string(frame) + ".pcd"));
  arguments.insert(arguments.end(),
                   {"--pose", test::recordedCloud("mosd_cyl_learn33.pcd")});
  if (std::count(arguments.begin(), arguments.end(), "") > 0)
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  arguments.insert(arguments.end(), {"--sensor", "xtion", "--json", "-", "--quiet"});
  arguments.insert(arguments.end(), {"--map", folder_ + "/map.png"});
  const ProgramRun run = calibrate(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // Independently, about whole tables: from 0.130 to 0.102 px.
  const Json map = Json::parse(run.out)["pattern_map"];
  const double before = map["rms_before_px"], after = map["rms_after_px"];
  EXPECT_NEAR(before, 0.130, 0.013);
  EXPECT_NEAR(after / before, 0.102 / 0.130, 0.05) << map;
}

TEST_F(CalibrateProgram, RecordedTablesHaveTheirKnownPattern)
{
  Names arguments;
  for (const int frame : {17, 18, 19, 20, 22})
    arguments.push_back(
        test::recordedCloud("mosd_static_learn" + std::to_string(frame) + ".pcd"));
  for (const std::string other : {"cyl_learn33", "cyl_learn37", "mixed_test45"})
    arguments.insert(arguments.end(),
                     {"--pose", test::recordedCloud("mosd_" + other + ".pcd")});
  if (std::count(arguments.begin(), arguments.end(), "") > 0)
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  const std::string path = folder_ + "/mine.yaml";
  arguments.insert(arguments.end(),
                   {"--sensor",
                    "xtion",
                    "-o",
                    path,
                    "--plot",
                    folder_ + "/plot.svg",
                    "--json",
                    "-"});
  const ProgramRun run = calibrate(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json pattern = Json::parse(run.out)["pattern"];
  ASSERT_EQ(pattern["waves"].size(), 2U) << pattern;
  EXPECT_EQ(pattern["poses"], 4);
  // As by variograms about whole tables, independently, with two exponential waves and
  // no white part: 0.089 px over 2.1 px, which is longer where part of it is taken for
  // white noise, and 0.103 px over 79 px.
  const Json &brief = pattern["waves"][0], &wide = pattern["waves"][1];
  EXPECT_EQ(brief["shape"], "exponential");
  const double white = pattern["white_px"]["value"];
  const double sigma = brief["sigma_px"]["value"];
  EXPECT_NEAR(std::hypot(white, sigma), 0.089, 0.01) << pattern;
  EXPECT_GT(brief["length_px"]["value"], 1.5) << pattern;
  EXPECT_LT(brief["length_px"]["value"], 3.2) << pattern;
  EXPECT_EQ(wide["shape"], "exponential");
  EXPECT_TRUE(contains(wide["sigma_px"], 0.103)) << pattern;
  EXPECT_GT(wide["length_px"]["value"], 40.0) << pattern;
  // A good part of it stays with the pixels of the camera, whatever the pose.
  EXPECT_GT(pattern["shared_part"]["interval"][0], 0.2) << pattern;
  EXPECT_LT(pattern["shared_part"]["interval"][1], 0.9) << pattern;

  const Sensor sensor = loadSensor(path);
  ASSERT_EQ(sensor.pattern.waves.size(), 2U);
  EXPECT_NEAR(sensor.pattern.waves[0].sigma, brief["sigma_px"]["value"], 1e-5);
  const auto& noise = dynamic_cast<const StereoNoiseModel&>(*sensor.noise);
  EXPECT_NEAR(noise.parameters().sigma_disparity_px,
              pattern["single_point_px"]["value"],
              1e-5);
  EXPECT_NE(test::readFile(folder_ + "/plot.svg").find("fitted pattern"),
            std::string::npos);
}

}} // namespace holdfast
