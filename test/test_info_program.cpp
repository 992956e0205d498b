#include <holdfast/io/cloud_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace holdfast { namespace {

using test::freshFolder;
using test::runProgram;
using Json = nlohmann::json;

TEST(InfoProgram, KnowsTheCloud)
{
  const std::string folder = freshFolder("info_json");
  const Pose pose = test::tiltedPose();
  RangeCloud cloud = test::bowlCloud(40, 30, pose, true);
  cloud.covariances[7](1, 1) = -1.0F;
  saveCloud(folder + "/bowl.pcd", cloud);
  const auto run = runProgram(folder, {"info", folder + "/bowl.pcd", "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["width"], 40);
  EXPECT_EQ(json["height"], 30);
  EXPECT_EQ(json["organized"], true);
  EXPECT_EQ(json["format"], "PCD binary");
  EXPECT_EQ(json["fields"], (std::vector<std::string>{"x", "y", "z", "covariance"}));
  EXPECT_EQ(json["valid_points"], 40 * 30 - 1);
  EXPECT_NEAR(json["nan_share"], 1.0 / 1200.0, 1e-12);
  EXPECT_EQ(json["covariances"]["invalid"], 1);
  EXPECT_EQ(json["covariances"]["valid"], 40 * 30 - 2);
  // Pose and camera went through nine digits and single precision.
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(json["sensor_pose"]["position"][i], pose.c(static_cast<int>(i)), 1e-7);
  EXPECT_NEAR(json["intrinsics"]["fx"], 60.0, 1e-2);
  EXPECT_NEAR(json["intrinsics"]["cx"], 19.5, 1e-2);
  EXPECT_LT(json["intrinsics"]["rms_px"], 1e-2);
  EXPECT_GT(json["depth_range"][0], 0.5);
  EXPECT_LT(json["depth_range"][1], 1.01); // 1 m and the ripple
  EXPECT_LE(json["min"][2], json["max"][2]);
}

TEST(InfoProgram, PlainTextOfSeveralClouds)
{
  const std::string folder = freshFolder("info_text");
  saveCloud(folder + "/a.pcd", test::bowlCloud(40, 30));
  test::writeFile(folder + "/b.ply",
                  test::plyBytes<double>(test::bowlCloud(8, 6), "ascii"));
  const auto run = runProgram(folder, {"info", folder});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  EXPECT_NE(run.out.find("40 x 30, organized"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("47 x 1, not organized"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("fx 60.0"), std::string::npos) << run.out;
  EXPECT_LT(run.out.find("a.pcd"), run.out.find("b.ply"));
}

TEST(InfoProgram, BadFilesDoNotStopTheOthers)
{
  const std::string folder = freshFolder("info_errors");
  saveCloud(folder + "/good.pcd", test::bowlCloud(40, 30));
  test::writeFile(folder + "/bad.pcd", "# .PCD v0.7\n");
  const auto run = runProgram(folder, {"info", folder, folder + "/missing.pcd"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.errorLines(), 2) << run.err;
  EXPECT_NE(run.out.find("good.pcd"), std::string::npos);
}

TEST(InfoProgram, RecordedCloudsHaveTheirKnownIntrinsics)
{
  const std::string folder = freshFolder("info_recorded");
  const std::string path = test::recordedCloud("pcl_table_mug_stereo.pcd");
  if (path.empty())
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  const auto run = runProgram(folder, {"info", path, "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NEAR(Json::parse(run.out)["intrinsics"]["fx"], 964.4, 0.5);
}

}} // namespace holdfast
