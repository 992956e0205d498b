#include <holdfast/geometry/rotation.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/io/trajectory_file.h>
#include <holdfast/simulation/trajectory.h>

#include "support/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;

class SimulateTrajectory : public testing::Test {
protected:
  SimulateTrajectory()
  : folder_(test::freshFolder(
        std::string("simulate_trajectory_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  , out_(folder_ + "/out")
  {}

  test::ProgramRun simulate(Names arguments) const
  {
    arguments.insert(arguments.begin(), "simulate");
    return test::runProgram(folder_, arguments);
  }

  /// On a coarse grid into a folder, which it returns; expects success.
  std::string make(const Names& arguments, const std::string& name = "out") const
  {
    Names all{"-o", folder_ + "/" + name, "--stride", "8"};
    all.insert(all.begin(), arguments.begin(), arguments.end());
    const test::ProgramRun run = simulate(all);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.err, "");
    EXPECT_EQ(run.out.find(folder_ + "/" + name + ": "), 0u) << run.out;
    EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1) << run.out;
    return folder_ + "/" + name;
  }

  std::string write(const std::string& name, const std::string& text) const
  {
    test::writeFile(folder_ + "/" + name, text);
    return folder_ + "/" + name;
  }

  /// One line that has the word in it, and no file but those from before.
  void expectFailure(const Names& arguments,
                     int code,
                     const std::string& word,
                     const Names& before) const
  {
    const test::ProgramRun run = simulate(arguments);
    SCOPED_TRACE(run.err);
    EXPECT_EQ(run.exit_code, code);
    EXPECT_EQ(run.errorLines(), 1);
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find(word), std::string::npos) << word;
    EXPECT_EQ(test::filesIn(folder_), before);
  }

  std::string folder_;
  std::string out_;
};

std::vector<Eigen::Vector3d>
pointsOf(const std::string& cloud)
{
  std::vector<Eigen::Vector3d> points;
  const RangeCloud loaded = loadCloud(cloud);
  EXPECT_TRUE(isIdentity(loaded.sensor_pose)) << "the points are in the camera's frame";
  for (const auto& point : *loaded.points)
    if (std::isfinite(point.x))
      points.push_back(point.getVector3fMap().cast<double>());
  return points;
}

TEST_F(SimulateTrajectory, WritesFramesPosesAndTruth)
{
  make({"rocks", "--trajectory", "circle", "--frames", "3", "--step", "0.2"});
  EXPECT_EQ(test::filesIn(folder_), Names{"out"});
  EXPECT_EQ(test::filesIn(out_),
            (Names{"frame_0000.pcd",
                   "frame_0001.pcd",
                   "frame_0002.pcd",
                   "trajectory.txt",
                   "truth.json"}));
  const RangeCloud cloud = loadCloud(out_ + "/frame_0002.pcd");
  EXPECT_EQ(cloud.points->width, 80u);
  EXPECT_EQ(cloud.points->height, 60u);

  const std::vector<StampedPose> poses = readTrajectory(out_ + "/trajectory.txt");
  const std::vector<Pose> expected = circle(makeScene("rocks"), 3, 0.2);
  ASSERT_EQ(poses.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(poses[k].stamp_s, static_cast<double>(k) / 5.0);
    EXPECT_EQ(poses[k].pose.c, expected[k].c);
    EXPECT_LT((poses[k].pose.R - expected[k].R).norm(), 1e-14);
  }

  const Json truth = Json::parse(test::readFile(out_ + "/truth.json"));
  EXPECT_EQ(truth.at("clouds"),
            (Json{"frame_0000.pcd", "frame_0001.pcd", "frame_0002.pcd"}));
  EXPECT_EQ(truth.at("scene"), "rocks");
  EXPECT_EQ(truth.at("trajectory"), "circle");
  EXPECT_EQ(truth.at("step_m"), 0.2);
  EXPECT_EQ(truth.at("pattern_over_time"), "fixed");
  EXPECT_EQ(truth.at("random_seed"), 1);
  EXPECT_EQ(truth.at("sensor").at("name"), "kinect_v1");
  EXPECT_FALSE(truth.at("sensor").contains("position"));
  EXPECT_FALSE(truth.contains("odometry"));
  EXPECT_EQ(truth.at("shapes").size(), makeScene("rocks").shapes.size());
}

TEST_F(SimulateTrajectory, PosesPutThePointsOnTheTrueSurface)
{
  for (const std::string way : {"walk", "circle"}) {
    SCOPED_TRACE(way);
    make({"table", "--trajectory", way, "--frames", "4", "--noise-scale", "0"}, way);
    const Scene scene = makeScene("table");
    const auto poses = readTrajectory(folder_ + "/" + way + "/trajectory.txt");
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Pose& pose = poses[k].pose;
      const auto points =
          pointsOf(folder_ + "/" + way + "/frame_000" + std::to_string(k) + ".pcd");
      EXPECT_GT(points.size(), 1000u);
      int off = 0;
      for (const Eigen::Vector3d& point : points) {
        const auto hit = firstHit(scene, pose.c, pose.R * point);
        // Single precision of metres, seen at angles down to a few degrees.
        off += !hit || std::abs(hit->t - 1.0) > 1e-5 ? 1 : 0;
      }
      // Rays along an edge may meet the other side of it.
      EXPECT_LE(off, 3);
    }
  }
}

TEST_F(SimulateTrajectory, NoisyPointsScatterAboutTheTableTop)
{
  const Names way{"table", "--trajectory", "circle", "--frames", "6", "--step", "0.5"};
  make(way, "noisy");
  Names without = way;
  without.insert(without.end(), {"--noise-scale", "0"});
  make(without, "true");
  const Sensor sensor = loadSensor("kinect_v1");
  double sum = 0.0;
  int n = 0;
  const auto poses = readTrajectory(folder_ + "/noisy/trajectory.txt");
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Pose& pose = poses[k].pose;
    const Eigen::Vector3d up = pose.R.transpose() * Eigen::Vector3d::UnitZ();
    const std::string name = "/frame_000" + std::to_string(k) + ".pcd";
    const RangeCloud noisy = loadCloud(folder_ + "/noisy" + name);
    const RangeCloud exact = loadCloud(folder_ + "/true" + name);
    for (std::size_t i = 0; i < exact.points->size(); ++i) {
      const auto truth = (*exact.points)[i].getVector3fMap().cast<double>().eval();
      // Whatever is that high: the top alone is.
      if (!(std::abs(pose.toWorld(truth).z() - 0.72) < 1e-6))
        continue;
      const auto point = (*noisy.points)[i].getVector3fMap().cast<double>().eval();
      const double sigma = std::sqrt(up.dot(sensor.noise->covariance(truth) * up));
      const double error = (pose.toWorld(point).z() - 0.72) / sigma;
      EXPECT_LT(std::abs(error), 6.0);
      sum += error * error;
      ++n;
    }
  }
  EXPECT_GT(n, 1000);
  // Loose: neighbours share most of it, and the frames do.
  EXPECT_GT(sum / n, 0.5);
  EXPECT_LT(sum / n, 2.0);
}

TEST_F(SimulateTrajectory, FramesDependOnTheSeedAndNotOnTheirNumber)
{
  const Names odometry{"--odometry-sigma-m", "0.01", "--odometry-sigma-rad", "0.01"};
  const auto run = [&](const std::string& name, const Names& more) {
    Names arguments{"ball", "--trajectory", "walk"};
    arguments.insert(arguments.end(), odometry.begin(), odometry.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return make(arguments, name);
  };
  const std::string two = run("two", {"--frames", "2"});
  const std::string four = run("four", {"--frames", "4"});
  const std::string other = run("other", {"--frames", "2", "--random-seed", "2"});
  const auto file = [](const std::string& folder, const std::string& name) {
    return test::readFile(folder + "/" + name);
  };
  for (const char* name : {"frame_0000.pcd", "frame_0001.pcd"}) {
    EXPECT_EQ(file(two, name), file(four, name));
    EXPECT_NE(file(two, name), file(other, name));
  }
  for (const char* name : {"trajectory.txt", "odometry.txt"})
    EXPECT_EQ(file(four, name).find(file(two, name)), 0u) << name;
  EXPECT_EQ(file(two, "trajectory.txt"), file(other, "trajectory.txt"));
  EXPECT_NE(file(two, "odometry.txt"), file(other, "odometry.txt"));
}

TEST_F(SimulateTrajectory, OdometryDriftsFromTheTruth)
{
  make(
      {"ball", "--trajectory", "walk", "--frames", "12", "--odometry-sigma-m", "0.01"});
  const auto truth = readTrajectory(out_ + "/trajectory.txt");
  const auto odometry = readTrajectory(out_ + "/odometry.txt");
  ASSERT_EQ(odometry.size(), truth.size());
  EXPECT_EQ(odometry.front().pose.c, truth.front().pose.c);
  double errors = 0.0;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    EXPECT_EQ(odometry[k].stamp_s, truth[k].stamp_s);
    const Pose right = truth[k - 1].pose.inverse() * truth[k].pose;
    const Pose said = odometry[k - 1].pose.inverse() * odometry[k].pose;
    // Without --odometry-sigma-rad rotations are right.
    EXPECT_LT(logMap(right.R.transpose() * said.R).norm(), 1e-13);
    errors += (right.c - said.c).squaredNorm() / 1e-4;
  }
  // Chi-square with 33 degrees of freedom: five standard deviations.
  EXPECT_NEAR(errors, 33.0, 5.0 * std::sqrt(66.0));
  const Json json = Json::parse(test::readFile(out_ + "/truth.json")).at("odometry");
  EXPECT_EQ(json, (Json{{"sigma_rad", 0.0}, {"sigma_m", 0.01}}));
}

TEST_F(SimulateTrajectory, FixedPatternStaysAndFreshDoesNot)
{
  // Standing still: what differs between two frames is what was drawn anew.
  const auto differences = [&](const Names& more, const std::string& name) {
    Names arguments{"plane_circle",
                    "--trajectory",
                    "circle",
                    "--frames",
                    "2",
                    "--step",
                    "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const std::string folder = make(arguments, name);
    const auto first = pointsOf(folder + "/frame_0000.pcd");
    const auto second = pointsOf(folder + "/frame_0001.pcd");
    EXPECT_EQ(first.size(), second.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < first.size(); ++i)
      sum += std::pow(first[i].z() - second[i].z(), 2);
    return sum / static_cast<double>(first.size());
  };
  const double fixed = differences({}, "fixed");
  const double fresh = differences({"--fresh-pattern"}, "fresh");
  EXPECT_GT(fixed, 0.0);
  // The pattern is more than half of a Kinect's variance.
  EXPECT_LT(fixed, 0.7 * fresh);
}

TEST_F(SimulateTrajectory, FollowsAFile)
{
  const std::string poses = write("poses.txt",
                                  "# from elsewhere\n"
                                  "10.5 0 0 1 1 0 0 0\n"
                                  "10.75 0.1 0 1 1 0 0 0\n"
                                  "11 0.2 0 1 1 0 0 0\n");
  make({"rocks", "--trajectory", poses}, "all");
  const auto all = readTrajectory(folder_ + "/all/trajectory.txt");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[1].stamp_s, 10.75);
  EXPECT_EQ(all[2].pose.c, Eigen::Vector3d(0.2, 0, 1));
  make({"rocks", "--trajectory", poses, "--frames", "2"}, "two");
  EXPECT_EQ(readTrajectory(folder_ + "/two/trajectory.txt").size(), 2u);

  // Jumps are named, and simulated.
  std::string text;
  for (int k = 0; k < 6; ++k)
    text += std::to_string(k) + (k < 4 ? " 0.0" : " 0.9") + std::to_string(k) +
            " 0 1 1 0 0 0\n";
  const test::ProgramRun run = simulate({"rocks",
                                         "--trajectory",
                                         write("jump.txt", text),
                                         "-o",
                                         folder_ + "/jump",
                                         "--stride",
                                         "16"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.errorLines(), 1) << run.err;
  EXPECT_NE(run.err.find("pose 4 (stamp 4)"), std::string::npos) << run.err;
}

struct FailingRun {
  Names arguments;
  int exit_code;
  std::string word; ///< that is in the message
};

/// \param folder with the files of poses that are named here.
std::vector<FailingRun>
failingRuns(const std::string& folder)
{
  const std::string one = folder + "/one.txt", two = folder + "/two.txt";
  const std::string back = folder + "/back.txt", sky = folder + "/sky.txt";
  return {
      {{"--trajectory", "walk", "--frames", "0"}, 2, "--frames"},
      {{"--trajectory", "walk", "--frames", "1"}, 2, "--frames"},
      {{"--trajectory", "walk", "--frames", "many"}, 2, "--frames"},
      {{"--trajectory", "walk", "--step", "-1"}, 2, "--step"},
      {{"--trajectory", "walk", "--step", "nan"}, 2, "--step"},
      {{"--trajectory", "walk", "--odometry-sigma-m", "nan"}, 2, "--odometry-sigma-m"},
      {{"--trajectory", "walk", "--odometry-sigma-rad", "-1"},
       2,
       "--odometry-sigma-rad"},
      {{"--trajectory", "walk", "--distance", "2"}, 2, "--distance"},
      {{"--trajectory", "walk", "--fresh-pattern", "--no-pattern"}, 2, "--no-pattern"},
      {{"--trajectory", "walk", "--fresh-pattern", "--sensor", "perfect"},
       2,
       "--fresh-pattern"},
      {{"--frames", "3"}, 2, "--trajectory"},
      {{"--step", "0.1"}, 2, "--trajectory"},
      {{"--odometry-sigma-m", "0.1"}, 2, "--trajectory"},
      {{"--fresh-pattern"}, 2, "--trajectory"},
      {{"--trajectory", two, "--frames", "3"}, 2, "--frames"},
      {{"--trajectory", two, "--step", "0.1"}, 2, "--step"},
      {{"--trajectory", two, "--distance", "1"}, 2, "--distance"},
      {{"--trajectory", one}, 1, "one.txt: has one pose"},
      {{"--trajectory", back}, 1, "back.txt: line 2: the stamp 0"},
      {{"--trajectory", folder + "/none.txt"}, 1, "none.txt: no such file"},
      {{"--trajectory", sky}, 1, "pose 1"},
  };
}

TEST_F(SimulateTrajectory, FailsWithOneLineAndNoFolder)
{
  write("one.txt", "0 0 0 1 1 0 0 0\n");
  write("two.txt", "0 0 0 1 1 0 0 0\n1 0 0 1 1 0 0 0\n");
  // The second looks at the sky.
  write("sky.txt", "0 0 0 1 1 0 0 0\n1 0 0 1 0 0 0 1\n");
  write("back.txt", "1 0 0 1 1 0 0 0\n0 0 0 1 1 0 0 0\n");
  std::filesystem::create_directory(folder_ + "/full");
  write("full/mine", "");
  const Names before = test::filesIn(folder_);
  const std::vector<FailingRun> cases = failingRuns(folder_);
  for (const FailingRun& c : cases) {
    Names arguments{"rocks", "-o", out_, "--stride", "16"};
    arguments.insert(arguments.end(), c.arguments.begin(), c.arguments.end());
    expectFailure(arguments, c.exit_code, c.word, before);
  }
  const Names walk{"rocks", "--trajectory", "walk", "--stride", "16", "-o"};
  const auto into = [&](const std::string& output) {
    Names arguments = walk;
    arguments.push_back(output);
    return arguments;
  };
  expectFailure(into(out_ + ".pcd"), 2, "--output", before);
  expectFailure(into(folder_ + "/full"),
                1,
                "full: is a folder with files in it",
                before);
  expectFailure(into(folder_ + "/one.txt"), 1, "one.txt: is there already", before);
  expectFailure(into(folder_ + "/none/out"), 1, "none/out: cannot be written", before);
  EXPECT_EQ(test::filesIn(folder_ + "/full"), Names{"mine"});
}

TEST_F(SimulateTrajectory, SaysInOneLineWhatItWrote)
{
  Names arguments{"table", "--trajectory", "circle", "--frames", "3", "--step", "0.2"};
  arguments.insert(arguments.end(), {"--stride", "16", "-o", out_});
  const test::ProgramRun run = simulate(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  std::size_t points = 0;
  for (const char* name : {"/frame_0000.pcd", "/frame_0001.pcd", "/frame_0002.pcd"})
    points += pointsOf(out_ + name).size();
  EXPECT_EQ(run.out,
            out_ + ": 3 frames of table by kinect_v1, 0.40 m of way, " +
                std::to_string(points) + " points\n");
  arguments.back() = folder_ + "/quiet";
  arguments.emplace_back("--quiet");
  const test::ProgramRun quiet = simulate(arguments);
  EXPECT_EQ(quiet.exit_code, 0) << quiet.err;
  EXPECT_EQ(quiet.out, "");
  EXPECT_EQ(quiet.err, "");
}

TEST_F(SimulateTrajectory, HelpNamesScenesAndShowsAnExample)
{
  const test::ProgramRun run = simulate({"--help"});
  for (const char* word :
       {"boulder_field", "stairway", "--trajectory", "--trajectory walk"})
    EXPECT_NE(run.out.find(word), std::string::npos) << word;
}

}} // namespace holdfast
