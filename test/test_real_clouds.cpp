// Objects of known size in recorded clouds, through the program.
#include "support/run_program.h"

#include <holdfast/io/cloud_io.h>

#include <pcl/io/pcd_io.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>

namespace holdfast { namespace {

using Json = nlohmann::json;

/// |radius| in millimetres of the one patch that `fit --whole` finds, NaN without one.
double
radiusOf(const pcl::PointCloud<pcl::PointXYZ>& points,
         const std::string& name,
         const std::string& surface)
{
  const std::string folder = test::freshFolder("real_" + name);
  RangeCloud cloud;
  cloud.points = points.makeShared();
  saveCloud(folder + "/object.pcd", cloud, false);
  const auto run = test::runProgram(
      folder,
      {"fit", folder + "/object.pcd", "--whole", "--surface", surface, "--json", "-"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  if (run.exit_code != 0)
    return std::nan("");
  const Json patch = Json::parse(run.out)["patches"][0];
  return 1e3 /
         std::abs(
             patch["parameters"][patch["boundary"] == "circle" ? 1 : 2].get<double>());
}

/// The points of one labelled object.
pcl::PointCloud<pcl::PointXYZ>
labelled(const std::string& path, std::uint32_t label)
{
  pcl::PointCloud<pcl::PointXYZL> cloud;
  pcl::PointCloud<pcl::PointXYZ> object;
  EXPECT_EQ(pcl::io::loadPCDFile(path, cloud), 0);
  for (const pcl::PointXYZL& p : cloud)
    if (p.label == label && std::isfinite(p.z))
      object.push_back({p.x, p.y, p.z});
  return object;
}

// Plain least squares gives 27.4 mm. The body without shoulder and bottom, which are no
// cylinder, and the half that one camera would see: a ring seen all around is as thick
// as long, and its scatter does not tell the normal.
TEST(RealClouds, SprayCan)
{
  const std::string path = test::recordedCloud("gpd_krylon_can.pcd");
  if (path.empty())
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  pcl::PointCloud<pcl::PointXYZ> body;
  const RangeCloud cloud = loadCloud(path);
  for (const pcl::PointXYZ& p : *cloud.points)
    if (p.z > -0.043F && p.z < 0.016F && p.x > 0.0F)
      body.push_back(p);
  EXPECT_NEAR(radiusOf(body, "can", "cylinder"), 27.4, 1.5);
}

// The inside of a bowl, sphere-like with 81 mm.
TEST(RealClouds, Bowl)
{
  const std::string path = test::recordedCloud("mosd_cyl_learn33.pcd");
  if (path.empty())
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  EXPECT_NEAR(radiusOf(labelled(path, 41), "bowl", "sphere"), 81.0, 1.5);
}

// The inside of a mug in two scenes: no radius is recorded, but it is one mug.
TEST(RealClouds, TheSameMugTwice)
{
  const std::string first = test::recordedCloud("mosd_cyl_learn33.pcd");
  const std::string second = test::recordedCloud("mosd_cyl_learn44.pcd");
  if (first.empty() || second.empty())
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  EXPECT_NEAR(radiusOf(labelled(first, 51), "mug_a", "cylinder"),
              radiusOf(labelled(second, 41), "mug_b", "cylinder"),
              1.5);
}

}} // namespace holdfast
