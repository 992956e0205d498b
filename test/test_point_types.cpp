#include "support/random.h"
#include "support/run_program.h"
#include "support/small_clouds.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/conversions.h>

#include <pcl/filters/extract_indices.h>
#include <pcl/filters/passthrough.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/io/pcd_io.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/search/kdtree.h>
#include <pcl/search/organized.h>

#include <gtest/gtest.h>

#include <array>
#include <cstring>

namespace holdfast { namespace {

using test::Random;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Eigen::Matrix3f
randomCovariance(Random& random)
{
  Eigen::Matrix3d A;
  for (int i = 0; i < 9; ++i)
    A(i) = 1e-3 * random.normal();
  return (A * A.transpose()).cast<float>();
}

pcl::PointCloud<PointXYZCovariance>
somePoints(Random& random)
{
  pcl::PointCloud<PointXYZCovariance> cloud(7, 5);
  for (PointXYZCovariance& point : cloud)
    point = PointXYZCovariance(random.normalVector().cast<float>(),
                               randomCovariance(random));
  cloud[3].getVector3fMap().setConstant(kNaN);
  cloud[4] = PointXYZCovariance(); // covariance unknown
  cloud.is_dense = false;
  return cloud;
}

/// Fields full of numbers that have no short decimal form.
pcl::PointCloud<PatchPoint>
somePatches(Random& random)
{
  const auto number = [&random] { return static_cast<float>(random.normal() / 3.0); };
  const auto byte = [&random] {
    return static_cast<std::uint8_t>(random.integer(0, 255));
  };
  pcl::PointCloud<PatchPoint> cloud(6, 1);
  for (PatchPoint& point : cloud) {
    point.getVector3fMap() = random.normalVector().cast<float>();
    point.getNormalVector3fMap() = random.unitVector().cast<float>();
    std::generate(std::begin(point.parameters), std::end(point.parameters), number);
    std::generate(std::begin(point.parameter_covariance),
                  std::end(point.parameter_covariance),
                  number);
    point.residual = number();
    point.coverage = number();
    point.chi2 = number();
    point.chi2_dof = random.integer(0, 1 << 30);
    point.points = random.integer(0, 1 << 30);
    point.seed = random.integer(-1, 1 << 30);
    point.radius = number();
    point.surface = byte();
    point.boundary = byte();
    point.status = byte();
    point.verdict = byte();
  }
  cloud[2].parameters[5] = cloud[2].x = kNaN;
  cloud.is_dense = false;
  return cloud;
}

/// Every registered field, as PCL sees the points. NaN equals NaN here, whatever its
/// bits: text does not keep them.
template <typename PointT>
bool
sameFields(const pcl::PointCloud<PointT>& a, const pcl::PointCloud<PointT>& b)
{
  pcl::PCLPointCloud2 fields_a, fields_b;
  pcl::toPCLPointCloud2(a, fields_a);
  pcl::toPCLPointCloud2(b, fields_b);
  if (a.width != b.width || a.height != b.height)
    return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (const pcl::PCLPointField& field : fields_a.fields)
      for (pcl::uindex_t k = 0; k < field.count; ++k) {
        const auto size = static_cast<std::size_t>(pcl::getFieldSize(field.datatype));
        const auto at = i * fields_a.point_step + field.offset + k * size;
        if (std::memcmp(&fields_a.data[at], &fields_b.data[at], size) == 0)
          continue;
        float x, y;
        std::memcpy(&x, &fields_a.data[at], sizeof x);
        std::memcpy(&y, &fields_b.data[at], sizeof y);
        if (field.datatype != pcl::PCLPointField::FLOAT32 || !std::isnan(x) ||
            !std::isnan(y))
          return false;
      }
  return true;
}

template <typename PointT>
void
expectRoundTrips(const pcl::PointCloud<PointT>& cloud, const std::string& folder)
{
  const std::string path = folder + "/points.pcd";
  pcl::PCDWriter writer;
  for (const std::string format : {"ascii", "binary", "compressed"}) {
    const int failed = format == "ascii"  ? writer.writeASCII(path, cloud, 9) :
                       format == "binary" ? writer.writeBinary(path, cloud) :
                                            writer.writeBinaryCompressed(path, cloud);
    ASSERT_EQ(failed, 0) << format;
    pcl::PointCloud<PointT> read;
    ASSERT_EQ(pcl::io::loadPCDFile(path, read), 0) << format;
    EXPECT_TRUE(sameFields(cloud, read)) << format;
  }
}

TEST(PcdFiles, KeepEveryFieldOfBothTypes)
{
  Random random;
  const std::string folder = test::freshFolder("point_types");
  expectRoundTrips(somePoints(random), folder);
  expectRoundTrips(somePatches(random), folder);
}

TEST(PcdFiles, PclToolsConvertPatches)
{
  if (std::system("command -v pcl_convert_pcd_ascii_binary >/dev/null") != 0)
    GTEST_SKIP() << "pcl_convert_pcd_ascii_binary is not installed (package pcl-tools)";
  Random random;
  const std::string folder = test::freshFolder("point_types_tool");
  const auto cloud = somePatches(random);
  pcl::PCDWriter().writeBinaryCompressed(folder + "/in.pcd", cloud);
  for (const char* format : {"0", "1", "2"}) {
    const std::string out = folder + "/out" + format + ".pcd";
    const std::string command = "pcl_convert_pcd_ascii_binary '" + folder +
                                "/in.pcd' '" + out + "' " + format + " 9 >/dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);
    pcl::PointCloud<PatchPoint> read;
    ASSERT_EQ(pcl::io::loadPCDFile(out, read), 0);
    EXPECT_TRUE(sameFields(cloud, read)) << "format " << format;
  }
}

TEST(PcdFiles, OfPointsWithCovariancesAreThoseOfTheProgram)
{
  const std::string folder = test::freshFolder("point_types_cloud");
  const std::string path = folder + "/cloud.pcd";
  const RangeCloud cloud = test::bowlCloud(12, 9, test::tiltedPose(), true);
  const auto points = toPointCloud(cloud);
  pcl::PCDWriter().writeBinary(path, points);
  const RangeCloud loaded = loadCloud(path);
  ASSERT_TRUE(loaded.covariances);
  EXPECT_EQ(loaded.covariances->size(), points.size());
  EXPECT_EQ(*loaded.covariances, *cloud.covariances);
  // PCL writes VIEWPOINT with six digits.
  EXPECT_TRUE(loaded.sensor_pose.R.isApprox(cloud.sensor_pose.R, 1e-5));

  saveCloud(path, cloud);
  pcl::PointCloud<PointXYZCovariance> read;
  ASSERT_EQ(pcl::io::loadPCDFile(path, read), 0);
  EXPECT_TRUE(sameFields(points, read));
}

TEST(Filters, PassCovariancesThrough)
{
  Random random;
  const auto cloud = somePoints(random).makeShared();
  pcl::PassThrough<PointXYZCovariance> pass;
  pass.setInputCloud(cloud);
  pass.setFilterFieldName("z");
  pass.setFilterLimits(0.0F, 10.0F);
  pcl::Indices kept;
  pass.filter(kept);
  pcl::PointCloud<PointXYZCovariance> filtered;
  pass.filter(filtered);
  ASSERT_GT(kept.size(), 5U);
  pcl::ExtractIndices<PointXYZCovariance> extract;
  extract.setInputCloud(cloud);
  extract.setIndices(pcl::make_shared<pcl::Indices>(kept));
  pcl::PointCloud<PointXYZCovariance> extracted;
  extract.filter(extracted);
  pcl::PointCloud<PointXYZCovariance> expected;
  for (const auto index : kept)
    expected.push_back((*cloud)[index]);
  EXPECT_TRUE(sameFields(filtered, expected));
  EXPECT_TRUE(sameFields(extracted, expected));
}

TEST(Filters, SelectPatchesByTheirFields)
{
  Random random;
  const auto cloud = somePatches(random).makeShared();
  pcl::PassThrough<PatchPoint> pass;
  pass.setInputCloud(cloud);
  pass.setFilterFieldName("coverage");
  pass.setFilterLimits(0.0F, 10.0F);
  pcl::PointCloud<PatchPoint> filtered;
  pass.filter(filtered);
  ASSERT_FALSE(filtered.empty());
  for (const PatchPoint& point : filtered)
    EXPECT_GE(point.coverage, 0.0F);
}

/// The mean of covariances is not the covariance of the mean point, and zero would make
/// it exact.
TEST(Filters, VoxelGridLeavesCovariancesUnknown)
{
  Random random;
  pcl::VoxelGrid<PointXYZCovariance> grid;
  grid.setInputCloud(somePoints(random).makeShared());
  grid.setLeafSize(0.5F, 0.5F, 0.5F);
  pcl::PointCloud<PointXYZCovariance> thinned;
  grid.filter(thinned);
  ASSERT_FALSE(thinned.empty());
  for (const PointXYZCovariance& point : thinned)
    EXPECT_TRUE(std::isnan(point.covariance[0]) && std::isnan(point.covariance[5]));
}

template <typename PointT>
void
expectNeighborsOfFirstPoint(pcl::search::Search<PointT>& search,
                            const typename pcl::PointCloud<PointT>::ConstPtr& cloud)
{
  search.setInputCloud(cloud);
  pcl::Indices found;
  std::vector<float> squared_distances;
  ASSERT_EQ(search.nearestKSearch(*cloud, 1, 1, found, squared_distances), 1);
  EXPECT_EQ(found[0], 1);
}

TEST(Searches, TakeBothTypes)
{
  const auto points = toPointCloud(test::bowlCloud(40, 30, {}, true)).makeShared();
  auto patches = pcl::make_shared<pcl::PointCloud<PatchPoint>>();
  pcl::copyPointCloud(*points, *patches);
  pcl::search::KdTree<PointXYZCovariance> point_tree;
  pcl::search::KdTree<PatchPoint> patch_tree;
  pcl::search::OrganizedNeighbor<PointXYZCovariance> pixels;
  expectNeighborsOfFirstPoint<PointXYZCovariance>(point_tree, points);
  expectNeighborsOfFirstPoint<PatchPoint>(patch_tree, patches);
  expectNeighborsOfFirstPoint<PointXYZCovariance>(pixels, points);
  EXPECT_TRUE(pixels.isValid());
}

}} // namespace holdfast
