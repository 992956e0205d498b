// The programs of samples/ find what there is in simulated scenes.
#include "support/run_program.h"

#include <holdfast/pcl/point_types.h>

#include <pcl/io/pcd_io.h>

#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <string>
#include <vector>

namespace holdfast { namespace {

const std::string kRocks = HOLDFAST_SOURCE_DIR "/samples/rocks.pcd";

class Samples : public testing::Test {
protected:
  Samples()
  : folder_(test::freshFolder(
        std::string("samples_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  {}

  void SetUp() override
  {
    if (std::string(HOLDFAST_SAMPLES).empty())
      GTEST_SKIP() << "the samples are not built: HOLDFAST_BUILD_SAMPLES";
  }

  /// Path of a simulated cloud with independent errors: the sigmas of models found by
  /// sample consensus have no part for a pattern.
  std::string simulate(const std::string& scene, const std::string& distance) const
  {
    const std::string path = folder_ + "/" + scene + ".pcd";
    const auto run = test::runProgram(
        folder_,
        {"simulate", scene, "--no-pattern", "--distance", distance, "-o", path});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return path;
  }

  /// What the sample says; it has to succeed.
  std::string sample(const std::string& name,
                     const std::vector<std::string>& arguments) const
  {
    const auto run = test::runSample(folder_, name, arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.out;
  }

  std::string folder_;
};

/// The radius, behind `what` in the output, is right within three of the sigmas behind
/// it. Those are of the noise of the inliers alone. That noise also decides which
/// points are inliers; at a threshold of two sigmas the variance of a fit to its own
/// inliers is that of all points over 1 - 4 phi(2) / (2 Phi(2) - 1) = 0.774 (three
/// sigmas: 0.973).
void
expectRadius(const std::string& output, const std::string& what, double radius_mm)
{
  const std::regex pattern(what + "radius ([0-9.]+).* sigma ([0-9.]+) mm");
  std::smatch match;
  ASSERT_TRUE(std::regex_search(output, match, pattern)) << output;
  EXPECT_NEAR(std::stod(match[1]),
              radius_mm,
              3.0 * std::stod(match[2]) / std::sqrt(0.774))
      << output;
}

TEST_F(Samples, CovarianceToPatches)
{
  const std::string out = sample("covariance_to_patches", {kRocks});
  EXPECT_NE(out.find("sigma up to"), std::string::npos) << out;
  EXPECT_NE(out.find(" patches at "), std::string::npos) << out;
  EXPECT_NE(out.find("kappa"), std::string::npos) << out;
  EXPECT_EQ(out.find("nan"), std::string::npos) << out;
}

TEST_F(Samples, PclPipelineWritesPatches)
{
  const std::string path = folder_ + "/patches.pcd";
  sample("pcl_pipeline", {kRocks, path});
  pcl::PointCloud<PatchPoint> patches;
  ASSERT_EQ(pcl::io::loadPCDFile(path, patches), 0);
  EXPECT_GT(patches.size(), 10U);
  for (const PatchPoint& patch : patches) {
    EXPECT_NEAR(patch.getNormalVector3fMap().norm(), 1.0F, 1e-5F);
    EXPECT_GT(patch.z, 0.0F); // what lies below 5 cm was cut
  }
  // What pcl_viewer reads of it.
  pcl::PointCloud<pcl::PointNormal> normals;
  ASSERT_EQ(pcl::io::loadPCDFile(path, normals), 0);
  EXPECT_EQ(normals.size(), patches.size());
}

TEST_F(Samples, CylinderInClutter)
{
  const std::string cloud = simulate("pipe", "0.7");
  expectRadius(sample("cylinder_in_clutter", {cloud, "320", "240"}), "", 60.0);
}

TEST_F(Samples, TableObjects)
{
  const std::string cloud = simulate("table", "1.2");
  expectRadius(sample("table_objects", {cloud}), "sphere outside ", 50.0);
}

TEST_F(Samples, SayHowToUseThem)
{
  for (const std::string name : {"first_patch",
                                 "covariance_to_patches",
                                 "pcl_pipeline",
                                 "cylinder_in_clutter",
                                 "table_objects"}) {
    EXPECT_EQ(test::runSample(folder_, name, {}).exit_code, 2);
    std::vector<std::string> arguments{folder_ + "/no_cloud.pcd"};
    if (name == "pcl_pipeline")
      arguments.push_back(folder_ + "/out.pcd");
    if (name == "cylinder_in_clutter")
      arguments.insert(arguments.end(), {"1", "1"});
    EXPECT_EQ(test::runSample(folder_, name, arguments).exit_code, 1) << name;
  }
}

}} // namespace holdfast
