#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>

#include "support/own_covariances.h"
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
  test::ownCovariances(cloud)[7](1, 1) = -1.0F;
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

TEST(InfoProgram, StandardInput)
{
  const std::string folder = freshFolder("info_stdin");
  saveCloud(folder + "/bowl.pcd", test::bowlCloud(40, 30));
  const auto run = test::runExecutable(
      folder,
      "/bin/sh",
      {"-c", std::string(HOLDFAST_PROGRAM) + " info - < " + folder + "/bowl.pcd"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out.find("standard input\n"), 0U) << run.out;
  EXPECT_NE(run.out.find("40 x 30, organized"), std::string::npos) << run.out;
  const auto empty = test::runExecutable(
      folder,
      "/bin/sh",
      {"-c", std::string(HOLDFAST_PROGRAM) + " info - < /dev/null"});
  EXPECT_EQ(empty.exit_code, 1);
  EXPECT_EQ(empty.errorLines(), 1) << empty.err;
}

TEST(InfoProgram, SaysWhatWasApplied)
{
  const std::string folder = freshFolder("info_applied");
  test::writeFile(folder + "/mm.pcd",
                  "VERSION 0.7\nFIELDS x y z\nWIDTH 4\nDATA ascii\n"
                  "10 20 -1000\n30 -40 -1500\n0 0 0\n0 0 0\n");
  const std::vector<std::string> words{"info",
                                       folder + "/mm.pcd",
                                       "--unit",
                                       "mm",
                                       "--axes",
                                       "opengl"};
  const auto text = runProgram(folder, words);
  ASSERT_EQ(text.exit_code, 0) << text.err;
  for (const std::string part : {"2 valid points, 50.0 % invalid",
                                 "depth        1.000 to 1.500 m",
                                 "unit         0.001 m",
                                 "axes         opengl",
                                 "2 points at the sensor are taken as invalid"})
    EXPECT_NE(text.out.find(part), std::string::npos) << part << "\n" << text.out;
  std::vector<std::string> as_json = words;
  as_json.insert(as_json.end(), {"--json", "-", "--sensor-pose"});
  for (const char* number : {"-0.5", "0.1", "2", "1", "0", "0", "0"})
    as_json.emplace_back(number);
  const auto run = runProgram(folder, as_json);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["unit_m"], 1e-3);
  EXPECT_EQ(json["axes"], "opengl");
  EXPECT_EQ(json["invalid_points"], 2);
  EXPECT_EQ(json["zero_points"], 2);
  EXPECT_EQ(json["sensor_pose"]["position"], (std::vector<double>{-0.5, 0.1, 2.0}));
  EXPECT_EQ(json["viewpoint"], Json());
  EXPECT_EQ(json["offset"], (std::vector<double>{0.0, 0.0, 0.0}));
}

TEST(InfoProgram, TheCameraOfAnImageIsSaid)
{
  const std::string folder = freshFolder("info_camera");
  test::writeFile(folder + "/depth.pgm", test::pgmBytes(test::bowlCloud(40, 30), 1000));
  const auto assumed = runProgram(folder, {"info", folder + "/depth.pgm"});
  ASSERT_EQ(assumed.exit_code, 0) << assumed.err;
  EXPECT_NE(assumed.out.find("camera assumed: fx 36.0"), std::string::npos)
      << assumed.out;
  EXPECT_NE(assumed.out.find("from the sensor kinect_v1"), std::string::npos);
  const auto given = runProgram(folder,
                                {"info",
                                 folder + "/depth.pgm",
                                 "--intrinsics",
                                 "60,61,19.5,14.5",
                                 "--json",
                                 "-"});
  ASSERT_EQ(given.exit_code, 0) << given.err;
  const Json json = Json::parse(given.out);
  EXPECT_EQ(json["camera"]["fy"], 61.0);
  EXPECT_EQ(given.out.find("assumed"), std::string::npos);
}

/// A plane in every pixel of a camera.
void
saveWall(const std::string& path, const Camera& camera)
{
  pcl::PointCloud<pcl::PointXYZ>::Ptr points(
      new pcl::PointCloud<pcl::PointXYZ>(static_cast<std::uint32_t>(camera.width),
                                         static_cast<std::uint32_t>(camera.height)));
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      (*points)(u, v).getVector3fMap() =
          camera.backProject(u, v, 1.5 + 1e-3 * u).cast<float>();
  saveCloud(path, {points, {}, {}});
}

TEST(InfoProgram, OtherAxesAndUnitsAreNamed)
{
  const std::string folder = test::freshFolder("info_axes");
  const std::string cloud = folder + "/rocks.pcd";
  ASSERT_EQ(
      test::runProgram(folder, {"simulate", "rocks", "--stride", "8", "-o", cloud})
          .exit_code,
      0);
  const auto noted = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"info", cloud};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::runProgram(folder, arguments).out;
  };
  EXPECT_EQ(noted({}).find("note"), std::string::npos);
  EXPECT_NE(noted({"--axes", "opengl"}).find("is wrong where it was given"),
            std::string::npos);
  const RangeCloud world = loadCloud(cloud);
  const auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*world.points);
  for (pcl::PointXYZ& p : *points) { // of a camera, upside down
    const Eigen::Vector3d q =
        world.sensor_pose.toLocal(p.getVector3fMap().cast<double>());
    p.getVector3fMap() =
        Eigen::Vector3d(1e3 * q.x(), -1e3 * q.y(), -1e3 * q.z()).cast<float>();
  }
  RangeCloud turned;
  turned.points = points;
  saveCloud(cloud, turned);
  EXPECT_NE(noted({}).find("--axes opengl"), std::string::npos);
  EXPECT_NE(noted({}).find("--unit mm"), std::string::npos);
}

TEST(InfoProgram, NamesTheSensorsWhosePixelsTheseAre)
{
  const std::string folder = freshFolder("info_sensors");
  const auto sensorsOf = [&](const Camera& camera) {
    saveWall(folder + "/wall.pcd", camera);
    const auto run = runProgram(folder, {"info", folder + "/wall.pcd", "--json", "-"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Json::parse(run.out)["sensors"].get<std::vector<std::string>>();
  };
  for (const std::string name :
       {"kinect_v1", "kinect_v2", "xtion", "azure_kinect", "zed_2", "iphone_lidar"})
    EXPECT_EQ(sensorsOf(loadSensor(name).camera), std::vector<std::string>{name});
  const auto text = runProgram(folder, {"info", folder + "/wall.pcd"});
  EXPECT_NE(text.out.find("like         iphone_lidar\n"), std::string::npos)
      << text.out;
  // Both RealSense cameras have the same image.
  EXPECT_EQ(sensorsOf(loadSensor("realsense_d455").camera),
            (std::vector<std::string>{"realsense_d435", "realsense_d455"}));
  EXPECT_TRUE(sensorsOf(test::smallCamera(40, 30)).empty());
}

TEST(InfoProgram, ABrokenSensorFileOfYourOwnIsSaid)
{
  const std::string folder = freshFolder("info_broken_sensor");
  saveWall(folder + "/wall.pcd", loadSensor("xtion").camera);
  test::writeFile(freshFolder("info_broken_sensor/own/sensors") + "/bad.yaml",
                  "name: [\n");
  const auto run = test::runExecutable(folder,
                                       "/usr/bin/env",
                                       {"HOLDFAST_CONFIG_DIR=" + folder + "/own",
                                        HOLDFAST_PROGRAM,
                                        "info",
                                        folder + "/wall.pcd"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("like         xtion\n"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("no sensor to compare with: "), std::string::npos) << run.out;
}

TEST(InfoProgram, WrongInputOptionsAreUsageErrors)
{
  const std::string folder = freshFolder("info_usage");
  saveCloud(folder + "/bowl.pcd", test::bowlCloud(8, 6));
  const std::string cloud = folder + "/bowl.pcd";
  const std::vector<std::vector<std::string>> wrong{
      {"--intrinsics", "525,525,319.5"},
      {"--intrinsics", "525,0,319.5,239.5"},
      {"--intrinsics", "a,b,c,d"},
      {"--unit", "inch"},
      {"--axes", "up"},
      {"--viewpoint", "1", "2", "x"},
      {"--sensor-pose", "0", "0", "0", "0", "0", "0", "0"},
      {"--max-points", "0"},
      {"--viewpoint",
       "0",
       "0",
       "1",
       "--sensor-pose",
       "0",
       "0",
       "0",
       "1",
       "0",
       "0",
       "0"}};
  for (const auto& options : wrong) {
    std::vector<std::string> words{"info", cloud};
    words.insert(words.end(), options.begin(), options.end());
    const auto run = runProgram(folder, words);
    EXPECT_EQ(run.exit_code, 2) << options[0] << ' ' << options[1] << run.err;
  }
  const auto many = runProgram(folder, {"info", cloud, "--max-points", "47"});
  EXPECT_EQ(many.exit_code, 1);
  EXPECT_EQ(many.errorLines(), 1) << many.err;
  EXPECT_NE(many.err.find("48 points"), std::string::npos) << many.err;
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
