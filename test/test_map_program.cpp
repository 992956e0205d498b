// `holdfast map`: frames and poses in, a map out, and one clear line where that cannot
// be.
#include "support/run_program.h"

#include <nlohmann/json.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Arguments = std::vector<std::string>;
namespace fs = std::filesystem;

std::string
contentOf(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class MapProgram : public testing::Test {
protected:
  /// Four frames around a table, made once.
  static void SetUpTestSuite()
  {
    folder_ = test::freshFolder("map_program");
    const auto run = test::runProgram(folder_,
                                      {"simulate",
                                       "table",
                                       "--trajectory",
                                       "circle",
                                       "--frames",
                                       "4",
                                       "--step",
                                       "0.03",
                                       "--stride",
                                       "4",
                                       "-o",
                                       folder_ + "/walk"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }

  static auto map(const Arguments& more, const std::string& frames = "walk")
  {
    Arguments arguments{"map", folder_ + "/" + frames};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::runProgram(folder_, arguments);
  }

  static std::string poses()
  {
    return folder_ + "/walk/trajectory.txt";
  }

  static std::string write(const std::string& name, const std::string& text)
  {
    const std::string path = folder_ + "/" + name;
    std::ofstream(path) << text;
    return path;
  }

  /// Refused in one line that says so, and nothing written.
  static void expectRefused(const Arguments& more,
                            int exit_code,
                            const std::string& part,
                            const std::string& frames = "walk")
  {
    const std::string output = folder_ + "/refused.json";
    Arguments arguments = more;
    arguments.insert(arguments.end(), {"--quiet", "-o", output});
    const auto run = map(arguments, frames);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
    const auto lines = std::count(run.err.begin(), run.err.end(), '\n');
    EXPECT_TRUE(exit_code == 2 || lines == 1) << run.err;
    EXPECT_FALSE(fs::exists(output));
  }

  static std::string folder_;
};

std::string MapProgram::folder_;

TEST_F(MapProgram, WritesTheMapInEveryForm)
{
  const std::string json = folder_ + "/map.json", stored = folder_ + "/map.map",
                    ply = folder_ + "/map.ply";
  const auto run = map({"--poses", poses(), "-o", json, "-o", stored, "--ply", ply});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("frame_0003.pcd: "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("independent views"), std::string::npos) << run.out;
  EXPECT_NE(run.err.find("--pose-sigma"), std::string::npos) << run.err;
  const auto object = nlohmann::json::parse(contentOf(json));
  ASSERT_FALSE(object.at("patches").empty());
  int most = 0;
  for (const auto& patch : object.at("patches")) {
    const auto& of = patch.at("map");
    EXPECT_EQ(of.at("jet").size(), 6u);
    EXPECT_EQ(of.at("jet_covariance").size(), 6u);
    EXPECT_EQ(of.at("support").size(), 16u);
    most = std::max(most, of.at("views").get<int>());
  }
  EXPECT_EQ(most, 4);
  EXPECT_EQ(object.at("cloud_points").at("in_file"), 4 * 160 * 120);
  EXPECT_GT(object.at("cloud_points").at("used"), 0);
  EXPECT_EQ(object.at("sensor").at("camera").at("width"), 160);
  EXPECT_EQ(object.at("sensor").at("name"), "kinect_v1");
  EXPECT_EQ(object.at("input").at("unit_m"), 1.0);
  EXPECT_NE(object.at("notices").dump().find("--pose-sigma"), std::string::npos);
  EXPECT_GT(fs::file_size(ply), 0u);
  const auto picture =
      test::runProgram(folder_,
                       {"render", json, "-o", folder_ + "/map.png", "--quiet"});
  EXPECT_EQ(picture.exit_code, 0) << picture.err;
}

TEST_F(MapProgram, GoesOnWhereItStopped)
{
  const std::string all = folder_ + "/all.map", half = folder_ + "/half.map",
                    rest = folder_ + "/rest.map";
  fs::create_directory(folder_ + "/later");
  for (const char* frame : {"frame_0002.pcd", "frame_0003.pcd"})
    fs::copy_file(folder_ + "/walk/" + frame,
                  folder_ + "/later/" + frame,
                  fs::copy_options::overwrite_existing);
  ASSERT_EQ(map({"-o", half, "--frames", "2"}).exit_code, 0);
  const auto run = map({"--resume", half, "-o", rest}, "later");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("from 4 frames"), std::string::npos) << run.out;
}

TEST_F(MapProgram, IsTheSameForAnyNumberOfThreads)
{
  const std::string one = folder_ + "/one.map", two = folder_ + "/two.map";
  ASSERT_EQ(map({"-o", one, "--threads", "1"}).exit_code, 0);
  ASSERT_EQ(map({"-o", two, "--threads", "2"}).exit_code, 0);
  EXPECT_TRUE(contentOf(one) == contentOf(two));
}

TEST_F(MapProgram, RefusesPosesThatAreNone)
{
  const std::string good = contentOf(poses());
  expectRefused({"--poses", folder_ + "/none.txt"}, 1, "none.txt: no such file");
  expectRefused({"--poses", write("few.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")},
                1,
                "2 poses for 4 frames");
  expectRefused({"--poses",
                 write("nan.txt",
                       "0 0 0 0 0 0 0 1\n1 nan 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"
                       "3 0 0 0 0 0 0 1\n")},
                1,
                "nan.txt: line 2");
  expectRefused({"--poses",
                 write("long.txt",
                       "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 3 1\n"
                       "3 0 0 0 0 0 0 1\n")},
                1,
                "long.txt: line 3");
  expectRefused({"--poses",
                 write("back.txt",
                       "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n0.5 0 0 0 0 0 0 1\n"
                       "3 0 0 0 0 0 0 1\n")},
                1,
                "back.txt: line 3");
  expectRefused({"--poses", poses(), "--pose-sigma", "0", "0.001"}, 2, "--pose-sigma");
  expectRefused({"--pose-sigma", "0.001", "0.001"}, 2, "--poses");
}

// A camera whose poses are the same stands still.
TEST_F(MapProgram, TakesEqualPosesAsStandingStill)
{
  const std::string still = write("still.txt",
                                  "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"
                                  "3 0 0 0 0 0 0 1\n");
  const std::string frame = folder_ + "/walk/frame_0000.pcd";
  const auto run = test::runProgram(
      folder_,
      {"map", frame, frame, frame, frame, "--poses", still, "-o", folder_ + "/s.json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto object = nlohmann::json::parse(contentOf(folder_ + "/s.json"));
  for (const auto& patch : object.at("patches"))
    EXPECT_EQ(patch.at("map").at("independent_views").get<int>(), 1);
}

TEST_F(MapProgram, RefusesFramesAndMapsThatAreNone)
{
  expectRefused({}, 1, "nowhere: ", "nowhere");
  fs::create_directory(folder_ + "/empty");
  expectRefused({}, 1, "no frame in this folder", "empty");
  const std::string stored = folder_ + "/cut.map";
  ASSERT_EQ(map({"-o", stored, "--frames", "1"}).exit_code, 0);
  const std::string bytes = contentOf(stored);
  write("cut.map", bytes.substr(0, bytes.size() / 2));
  expectRefused({"--resume", stored}, 1, "cut.map: is cut short");
  write("cut.map", bytes);
  expectRefused({"--resume", stored, "--sensor", "realsense_d435"},
                1,
                "is a map of sensor");
  expectRefused({"--surface", "sphere"}, 2, "--surface");
  write("walk.oni", "");
  expectRefused({}, 1, "holdfast live", "walk.oni");
  const auto run = map({"-o", folder_ + "/map.txt"});
  EXPECT_EQ(run.exit_code, 2);
}

}} // namespace holdfast
