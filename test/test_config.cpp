#include <holdfast/io/config.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace holdfast { namespace {

namespace fs = std::filesystem;

const std::string kGood = "name: mine\n" // 1
                          "camera:\n" // 2
                          "  width: 320\n" // 3
                          "  height: 240\n" // 4
                          "  fx: 300.5\n" // 5
                          "  fy: 301\n" // 6
                          "  cx: 159.5\n" // 7
                          "  cy: 119.5\n" // 8
                          "range:\n" // 9
                          "  min_m: 0.4\n" // 10
                          "  max_m: 5\n" // 11
                          "disparity:\n" // 12
                          "  baseline_m: 0.06\n" // 13
                          "  focal_px: 310\n" // 14
                          "  quantum_px: 0.25\n" // 15
                          "noise:\n" // 16
                          "  model: stereo\n" // 17
                          "  sigma_point_px: 0.3\n" // 18
                          "  sigma_disparity_px: 0.2\n"; // 19

class SensorFile : public testing::Test {
protected:
  SensorFile()
  : folder_(fs::path(HOLDFAST_SCRATCH_DIR) /
            (std::string("config_") +
             testing::UnitTest::GetInstance()->current_test_info()->name()))
  , file_((folder_ / "sensor.yaml").string())
  {
    fs::create_directories(folder_);
  }

  ~SensorFile() override
  {
    fs::remove_all(folder_);
  }

  void write(const std::string& text) const
  {
    std::ofstream(file_) << text;
  }

  /// The good file with one piece replaced.
  void writeChanged(const std::string& piece, const std::string& by) const
  {
    std::string text = kGood;
    ASSERT_NE(text.find(piece), std::string::npos) << piece;
    write(text.replace(text.find(piece), piece.size(), by));
  }

  /// What loading it complains about, without the file's name in front.
  std::string complaint() const
  {
    try {
      loadSensor(file_);
    }
    catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.rfind(file_ + ":", 0), 0u) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message.substr(std::min(message.size(), file_.size() + 1));
    }
    return "";
  }

  fs::path folder_;
  std::string file_;
};

TEST_F(SensorFile, EveryValueArrives)
{
  write(kGood);
  const Sensor sensor = loadSensor(file_);
  EXPECT_EQ(sensor.name, "mine");
  EXPECT_EQ(sensor.camera.width, 320);
  EXPECT_EQ(sensor.camera.height, 240);
  EXPECT_EQ(sensor.camera.fx, 300.5);
  EXPECT_EQ(sensor.camera.fy, 301.0);
  EXPECT_EQ(sensor.camera.cx, 159.5);
  EXPECT_EQ(sensor.camera.cy, 119.5);
  EXPECT_EQ(sensor.min_range_m, 0.4);
  EXPECT_EQ(sensor.max_range_m, 5.0);
  EXPECT_EQ(sensor.baseline_m, 0.06);
  EXPECT_EQ(sensor.disparity_focal_px, 310.0);
  EXPECT_EQ(sensor.disparity_quantum_px, 0.25);
  const auto stereo = std::dynamic_pointer_cast<const StereoNoiseModel>(sensor.noise);
  ASSERT_NE(stereo, nullptr);
  EXPECT_EQ(stereo->parameters().sigma_point_px, 0.3);
  EXPECT_EQ(stereo->parameters().sigma_disparity_px, 0.2);
  EXPECT_EQ(stereo->parameters().baseline_m, 0.06) << "from disparity";
  EXPECT_EQ(stereo->parameters().focal_px, 310.0) << "from disparity";
}

TEST_F(SensorFile, TheNoiseMayHaveItsOwnFocalLength)
{
  write(kGood + "  focal_px: 320\n");
  const auto stereo =
      std::dynamic_pointer_cast<const StereoNoiseModel>(loadSensor(file_).noise);
  ASSERT_NE(stereo, nullptr);
  EXPECT_EQ(stereo->parameters().focal_px, 320.0);
}

TEST_F(SensorFile, ErrorsNameLineAndKey)
{
  struct Case {
    std::string piece, by, message;
  };
  const std::vector<Case> cases{
      {"name: mine\n", "", "1: name is missing"},
      {"  fx: 300.5\n", "", "2: camera.fx is missing"},
      {"  sigma_point_px: 0.3\n", "", "16: noise.sigma_point_px is missing"},
      {"  baseline_m: 0.06\n", "", "12: disparity.baseline_m is missing"},
      {"  cy: 119.5\n", "  cy: 119.5\n  k1: 0.1\n", "9: camera.k1 is not a known key"},
      {"range:\n", "colour: red\nrange:\n", "9: colour is not a known key"},
      {"  max_m: 5\n", "  max_m: 5\n  max_m: 6\n", "12: range.max_m is given twice"},
      {"noise:\n", "noise:\n  sigma_m: 1\n", "17: noise.sigma_m is not a known key"},
      {"fx: 300.5", "fx: wide", "5: camera.fx must be a finite number"},
      {"fx: 300.5", "fx: [1, 2]", "5: camera.fx must be a finite number"},
      {"fx: 300.5", "fx:", "5: camera.fx must be a finite number"},
      {"fx: 300.5", "fx: .nan", "5: camera.fx must be a finite number"},
      {"cx: 159.5", "cx: .inf", "7: camera.cx must be a finite number"},
      {"fx: 300.5", "fx: -300.5", "5: camera.fx must be > 0"},
      {"width: 320", "width: 0", "3: camera.width must be a whole number from 1 to "},
      {"width: 320", "width: 3.5", "3: camera.width must be a whole number from 1 to "},
      {"height: 240", "height: 1e9", "4: camera.height must be a whole number from 1"},
      {"min_m: 0.4", "min_m: -1", "10: range.min_m must be >= 0"},
      {"max_m: 5", "max_m: 0.4", "11: range.max_m must be larger than min_m"},
      {"focal_px: 310", "focal_px: 0", "14: disparity.focal_px must be > 0"},
      {"quantum_px: 0.25", "quantum_px: 0", "15: disparity.quantum_px must be > 0"},
      {"model: stereo", "model: magic", "17: noise.model names no noise model: magic"},
      {"model: stereo", "model: [a]", "17: noise.model must be a word"},
      {"sigma_point_px: 0.3",
       "sigma_point_px: -0.3",
       "18: noise.sigma_point_px must be a finite number >= 0"},
      {"name: mine", "name:", "1: name must be a word"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.piece + " -> " + c.by);
    writeChanged(c.piece, c.by);
    const std::string message = complaint();
    EXPECT_EQ(message.rfind(c.message, 0), 0u) << message;
  }
}

TEST_F(SensorFile, APatternArrives)
{
  write(kGood + "  pattern:\n"
                "    - {sigma_px: 0.12, length_px: 1.5, shape: exponential}\n"
                "    - sigma_px: 0.16\n"
                "      length_px: 40\n"
                "      shape: gaussian\n");
  const NoisePattern pattern = loadSensor(file_).pattern;
  ASSERT_EQ(pattern.waves.size(), 2u);
  EXPECT_EQ(pattern.waves[0].sigma, 0.12);
  EXPECT_EQ(pattern.waves[0].length_px, 1.5);
  EXPECT_EQ(pattern.waves[0].shape, PatternShape::Exponential);
  EXPECT_EQ(pattern.waves[1].sigma, 0.16) << "0.12^2 + 0.16^2 = 0.2^2 is just allowed";
  EXPECT_EQ(pattern.waves[1].length_px, 40.0);
  EXPECT_EQ(pattern.waves[1].shape, PatternShape::Gaussian);
  write(kGood);
  EXPECT_TRUE(loadSensor(file_).pattern.empty());
  write(kGood + "  pattern: []\n");
  EXPECT_TRUE(loadSensor(file_).pattern.empty());
}

TEST_F(SensorFile, ErrorsOfAPatternNameLineAndKey)
{
  const std::string good = "{sigma_px: 0.1, length_px: 2, shape: gaussian}";
  struct Case {
    std::string value, message;
  };
  const std::vector<Case> cases{
      {" 0.1\n", "20: noise.pattern must be a list"},
      {" " + good + "\n", "20: noise.pattern must be a list"},
      {"\n", "20: noise.pattern must be a list"},
      {"\n    - 0.1\n", "21: noise.pattern[0] must be a list of `key: value`"},
      {"\n    - " + good + "\n    - {sigma_px: -0.1, length_px: 2, shape: gaussian}\n",
       "22: noise.pattern[1].sigma_px must be >= 0"},
      {"\n    - {sigma_px: 0.1, length_px: 0, shape: gaussian}\n",
       "21: noise.pattern[0].length_px must be > 0"},
      {"\n    - {sigma_px: 0.1, length_px: .inf, shape: gaussian}\n",
       "21: noise.pattern[0].length_px must be a finite number"},
      {"\n    - sigma_px: 0.1\n      length_px: 2\n      shape: round\n",
       "23: noise.pattern[0].shape must be exponential or gaussian, not round"},
      {"\n    - {sigma_px: 0.1, length_px: 2}\n",
       "21: noise.pattern[0].shape is missing"},
      {"\n    - {sigma_px: 0.1, length_px: 2, shape: gaussian, phase: 1}\n",
       "21: noise.pattern[0].phase is not a known key"},
      {"\n    - {sigma_m: 0.1, length_px: 2, shape: gaussian}\n",
       "21: noise.pattern[0].sigma_px is missing"},
      {"\n    - " + good + "\n    - {sigma_px: 0.2, length_px: 9, shape: gaussian}\n",
       "20: noise.pattern has a sigma of 0.2236 in all, more than the 0.2 of a single "
       "point, of which it is a part"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.value);
    write(kGood + "  pattern:" + c.value);
    EXPECT_EQ(complaint(), c.message);
  }
}

TEST_F(SensorFile, APatternOfAnotherModelIsInMetresAtOneMetre)
{
  const auto withSigma = [](const std::string& sigma) {
    std::string text = kGood.substr(0, kGood.find("noise:"));
    return text +
           "noise:\n  model: linear\n  sigma_m: 0.001\n  sigma_per_m: 0.002\n"
           "  sigma_lateral_rad: 0.001\n  pattern:\n    - {sigma_m: " +
           sigma + ", length_px: 2, shape: gaussian}\n";
  };
  write(withSigma("0.0029"));
  ASSERT_EQ(loadSensor(file_).pattern.waves.size(), 1u);
  EXPECT_EQ(loadSensor(file_).pattern.waves[0].sigma, 0.0029);
  write(withSigma("0.0031"));
  EXPECT_EQ(complaint().rfind("21: noise.pattern has a sigma of 0.0031 in all", 0), 0u)
      << complaint();
}

TEST_F(SensorFile, ASavedPatternComesBackToTheLastDigit)
{
  write(kGood);
  Sensor sensor = loadSensor(file_);
  sensor.pattern.waves = {{0.1 / 3.0, 1.0 / 3.0, PatternShape::Exponential},
                          {0.1, 100.0 / 7.0, PatternShape::Gaussian}};
  NoiseParameters noise{{"sigma_point_px", 0.3},
                        {"sigma_disparity_px", 0.2},
                        {"baseline_m", 0.06},
                        {"focal_px", 310.0}};
  saveSensor(file_, sensor, noise, {{"noise.pattern", "Measured."}});
  const NoisePattern back = loadSensor(file_).pattern;
  ASSERT_EQ(back.waves.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.waves[i].sigma, sensor.pattern.waves[i].sigma);
    EXPECT_EQ(back.waves[i].length_px, sensor.pattern.waves[i].length_px);
    EXPECT_EQ(back.waves[i].shape, sensor.pattern.waves[i].shape);
  }
  noise["sigma_disparity_px"] = 0.1;
  EXPECT_THROW(saveSensor(file_, sensor, noise), std::invalid_argument)
      << "more than the noise of a point";
  noise["sigma_disparity_px"] = 0.2;
  sensor.pattern.waves[0].length_px = 0.0;
  EXPECT_THROW(saveSensor(file_, sensor, noise), std::invalid_argument);

  sensor.pattern.waves = {{0.001, 3.0, PatternShape::Gaussian}};
  sensor.noise = makeNoiseModel("constant", {{"sigma_m", 0.002}});
  saveSensor(file_, sensor, {{"sigma_m", 0.002}});
  EXPECT_EQ(loadSensor(file_).pattern.waves.at(0).sigma, 0.001);
}

TEST_F(SensorFile, SectionsMustBeMaps)
{
  write("");
  EXPECT_EQ(complaint(), "1: file must be a list of `key: value`");
  write("just words\n");
  EXPECT_EQ(complaint(), "1: file must be a list of `key: value`");
  write("name: a\ncamera: 5\n");
  EXPECT_EQ(complaint(), "2: camera must be a list of `key: value`");
  write("name: a\n[1, 2]: 5\n");
  EXPECT_NE(complaint(), "");
}

TEST_F(SensorFile, BrokenYamlNamesTheLine)
{
  write("name: a\ncamera: {width: 3\n");
  EXPECT_NE(complaint(), "");
  write("name: a\n\tcamera: 5\n");
  EXPECT_EQ(complaint().rfind("2: ", 0), 0u) << complaint();
}

TEST_F(SensorFile, SavedSensorsComeBackToTheLastDigit)
{
  write(kGood);
  Sensor sensor = loadSensor(file_);
  sensor.camera.fx = 525.0 / 7.0;
  sensor.max_range_m = 1e3;
  for (const std::string name : {"mine", "yes", "17", "a: b", "it's #1"}) {
    sensor.name = name;
    saveSensor(file_,
               sensor,
               {{"sigma_point_px", 0.1 + 0.2},
                {"sigma_disparity_px", 1e-17},
                {"baseline_m", 0.06},
                {"focal_px", 310.0}});
    const Sensor back = loadSensor(file_);
    EXPECT_EQ(back.name, name);
    EXPECT_EQ(back.camera.width, 320);
    EXPECT_EQ(back.camera.height, 240);
    EXPECT_EQ(back.camera.fx, sensor.camera.fx);
    EXPECT_EQ(back.camera.cy, 119.5);
    EXPECT_EQ(back.min_range_m, 0.4);
    EXPECT_EQ(back.max_range_m, 1e3);
    EXPECT_EQ(back.baseline_m, 0.06);
    EXPECT_EQ(back.disparity_focal_px, 310.0);
    EXPECT_EQ(back.disparity_quantum_px, 0.25);
    const auto& noise = dynamic_cast<const StereoNoiseModel&>(*back.noise);
    EXPECT_EQ(noise.parameters().sigma_point_px, 0.1 + 0.2);
    EXPECT_EQ(noise.parameters().sigma_disparity_px, 1e-17);
  }
  sensor.disparity_quantum_px = 0.0;
  sensor.noise = makeNoiseModel("constant", {{"sigma_m", 0.002}});
  saveSensor(file_, sensor, {{"sigma_m", 0.002}});
  EXPECT_EQ(loadSensor(file_).disparity_quantum_px, 0.0);
  EXPECT_EQ(loadSensor(file_).noise->name(), "constant");
}

TEST_F(SensorFile, CommentsStandAboveTheirKeys)
{
  const Sensor sensor = loadSensor("realsense_d435");
  const NoiseParameters noise{{"sigma_point_px", 0.35},
                              {"sigma_disparity_px", 0.08},
                              {"baseline_m", 0.05},
                              {"focal_px", 446.8}};
  std::string long_text = "Measured";
  for (int i = 0; i < 40; ++i)
    long_text += " and measured";
  saveSensor(file_,
             sensor,
             noise,
             {{"", "One of ours."},
              {"camera.fx", "Wide: # and \"quotes\" do no harm."},
              {"range", "From the data sheet."},
              {"noise.sigma_disparity_px", long_text}});
  std::ifstream in(file_);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(text.rfind("# One of ours.\nname: realsense_d435\n", 0), 0u) << text;
  EXPECT_NE(text.find("  # Wide: # and \"quotes\" do no harm.\n  fx: 446.8\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("\n# From the data sheet.\nrange:\n"), std::string::npos) << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    EXPECT_LE(line.size(), 88u) << line;
  EXPECT_EQ(loadSensor(file_).camera.fx, 446.8);
}

TEST_F(SensorFile, WhatCannotBeSavedLeavesTheOldFile)
{
  write(kGood);
  const Sensor sensor = loadSensor(file_);
  const NoiseParameters noise{{"sigma_point_px", 0.35},
                              {"sigma_disparity_px", 0.08},
                              {"baseline_m", 0.05},
                              {"focal_px", 446.8}};
  EXPECT_THROW(saveSensor(file_, sensor, {{"sigma_m", 1.0}}), std::invalid_argument);
  EXPECT_THROW(saveSensor(file_, sensor, noise, {{"camera.fz", "depth"}}),
               std::invalid_argument);
  EXPECT_THROW(saveSensor((folder_ / "none" / "a.yaml").string(), sensor, noise),
               std::runtime_error);
  EXPECT_EQ(loadSensor(file_).camera.fx, 300.5);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()),
            1);
}

TEST(BuiltInSensors, AllLoadUnderTheirNames)
{
  const std::vector<std::string> names = listSensors();
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  for (const std::string name : {"kinect_v1",
                                 "kinect_v2",
                                 "xtion",
                                 "realsense_d435",
                                 "realsense_d455",
                                 "azure_kinect",
                                 "zed_2",
                                 "iphone_lidar",
                                 "velodyne_vlp16",
                                 "ouster_os1",
                                 "perfect"})
    EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
  for (const std::string& name : names) {
    const Sensor sensor = loadSensor(name);
    EXPECT_EQ(sensor.name, name);
    ASSERT_NE(sensor.noise, nullptr);
    EXPECT_TRUE(sensor.noise->covariance({0.1, 0.2, 1.0}).allFinite());
  }
}

TEST(BuiltInSensors, CarryThePublishedNumbers)
{
  const Sensor kinect = loadSensor("kinect_v1");
  EXPECT_EQ(kinect.camera.fx, 575.8);
  EXPECT_EQ(kinect.baseline_m, 0.075);
  EXPECT_EQ(kinect.disparity_quantum_px, 0.125);
  EXPECT_EQ(loadSensor("xtion").camera.fx, 525.0);
  for (const std::string name : {"kinect_v1", "xtion"})
    EXPECT_NEAR(std::sqrt(loadSensor(name).pattern.variance()), 0.1361, 5e-4)
        << name << ": measured";
  EXPECT_TRUE(loadSensor("perfect").pattern.empty());
  EXPECT_TRUE(loadSensor("perfect").noise->covariance({1, 1, 3}).isZero(0.0));
  const Sensor d435 = loadSensor("realsense_d435");
  // Half of 848 px at 43.5 degrees, given with one decimal.
  EXPECT_NEAR(d435.camera.fx, 424.0 / std::tan(43.5 * std::acos(-1.0) / 180.0), 0.05);
  // z^2 subpixel / (f b) at 2 m.
  EXPECT_NEAR(std::sqrt(d435.noise->covariance({0, 0, 2})(2, 2)),
              4.0 * 0.08 / (446.8 * 0.05),
              1e-15);
}

/// Standard deviation of the depth of a surface that faces the sensor, m.
double
sigmaAt(const std::string& sensor, double depth_m)
{
  return std::sqrt(loadSensor(sensor).noise->covariance({0, 0, depth_m})(2, 2));
}

TEST(BuiltInSensors, HaveTheNoiseThatTheirSourcesState)
{
  EXPECT_NEAR(sigmaAt("realsense_d455", 4.0), 16.0 * 0.08 / (446.8 * 0.095), 1e-15);
  // 1 % at 3 m and 5 % at 15 m, from a sigma of three digits.
  EXPECT_NEAR(sigmaAt("zed_2", 3.0), 0.03, 1e-4);
  EXPECT_NEAR(sigmaAt("zed_2", 15.0), 0.75, 2e-3);
  // 1.5 - 0.5 z + 0.3 z^2 mm, from numbers of four digits.
  for (const double z : {0.5, 1.0, 2.0, 4.0})
    EXPECT_NEAR(sigmaAt("kinect_v2", z), 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z), 2e-7);
  EXPECT_NEAR(sigmaAt("azure_kinect", 3.86), 0.017, 2e-5);
  EXPECT_NEAR(sigmaAt("iphone_lidar", 2.0), 0.01, 1e-15);
  EXPECT_NEAR(sigmaAt("velodyne_vlp16", 20.0), 0.03, 1e-15);
  EXPECT_NEAR(sigmaAt("ouster_os1", 20.0), 0.015, 1e-15);
  for (const std::string name : {"velodyne_vlp16", "ouster_os1"})
    EXPECT_TRUE(loadSensor(name).noise->isOmnidirectional()) << name;
}

TEST(BuiltInSensors, AnUnknownNameListsTheKnown)
{
  try {
    loadSensor("kinekt");
    FAIL() << "found";
  }
  catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.rfind("sensor kinekt: ", 0), 0u) << message;
    EXPECT_NE(message.find("kinect_v1"), std::string::npos) << message;
  }
  EXPECT_THROW(loadSensor(""), std::runtime_error);
  EXPECT_THROW(loadSensor("../sensors/kinect_v1"), std::runtime_error);
  EXPECT_THROW(loadSensor(HOLDFAST_SCRATCH_DIR), std::runtime_error);
}

TEST_F(SensorFile, FolderOfTheEnvironmentComesFirst)
{
  fs::create_directories(folder_ / "sensors");
  std::string text = kGood;
  text.replace(text.find("mine"), 4, "special");
  std::ofstream(folder_ / "sensors" / "kinect_v1.yaml") << text;
  std::ofstream(folder_ / "sensors" / "of_my_own.yaml") << text;
  ASSERT_EQ(setenv("HOLDFAST_CONFIG_DIR", folder_.c_str(), 1), 0);
  EXPECT_EQ(loadSensor("kinect_v1").name, "special");
  EXPECT_EQ(loadSensor("of_my_own").name, "special");
  EXPECT_EQ(loadSensor("xtion").name, "xtion") << "still found where it was";
  const std::vector<std::string> names = listSensors();
  EXPECT_EQ(std::count(names.begin(), names.end(), "of_my_own"), 1);
  EXPECT_EQ(std::count(names.begin(), names.end(), "kinect_v1"), 1);
  unsetenv("HOLDFAST_CONFIG_DIR");
}

}} // namespace holdfast
