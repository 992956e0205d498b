#include <holdfast/io/cloud_io.h>

#include "support/own_covariances.h"
#include "support/random.h"
#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>

namespace holdfast { namespace {

using test::bowlCloud;
using test::freshFolder;
using test::writeFile;

constexpr int kWidth = 12;
constexpr int kHeight = 9;
constexpr double kScale = 5000.0;

LoadOptions
smallOptions()
{
  LoadOptions options;
  options.depth_scale = kScale;
  options.camera = test::smallCamera(kWidth, kHeight);
  return options;
}

std::string
savedBytes(const std::string& folder, const RangeCloud& cloud, bool ascii)
{
  saveCloud(folder + "/saved.pcd", cloud, ascii);
  return test::readFile(folder + "/saved.pcd");
}

/// One file of every format, by name, all of the same cloud.
std::map<std::string, std::string>
everyFormat(const std::string& folder)
{
  const RangeCloud plain = bowlCloud(kWidth, kHeight);
  const RangeCloud full = bowlCloud(kWidth, kHeight, test::tiltedPose(), true);
  return {{"ascii.pcd", savedBytes(folder, plain, true)},
          {"binary.pcd", savedBytes(folder, plain, false)},
          {"covariance_ascii.pcd", savedBytes(folder, full, true)},
          {"covariance_binary.pcd", savedBytes(folder, full, false)},
          {"compressed.pcd", test::compressedPcd(plain)},
          {"ascii.ply", test::plyBytes<float>(plain, "ascii")},
          {"float.ply", test::plyBytes<float>(plain, "binary_little_endian")},
          {"double.ply", test::plyBytes<double>(plain, "binary_little_endian")},
          {"depth.pgm", test::pgmBytes(plain, kScale)},
          {"depth.png", test::pngBytes(plain, kScale)}};
}

/// What loadCloud() says about these bytes; empty when it takes them.
std::string
complaint(const std::string& path, const std::string& bytes)
{
  writeFile(path, bytes);
  try {
    loadCloud(path, smallOptions());
    return {};
  }
  catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find(path + ": "), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
}

void
expectSamePoints(const RangeCloud& a, const RangeCloud& b, float tolerance)
{
  ASSERT_EQ(a.points->size(), b.points->size());
  EXPECT_EQ(a.points->width, b.points->width);
  for (std::size_t i = 0; i < a.points->size(); ++i) {
    const Eigen::Vector3f p = (*a.points)[i].getVector3fMap();
    const Eigen::Vector3f q = (*b.points)[i].getVector3fMap();
    if (p.allFinite())
      EXPECT_LE((p - q).cwiseAbs().maxCoeff(), tolerance) << "point " << i;
    else
      EXPECT_FALSE(q.allFinite()) << "point " << i;
  }
}

TEST(CloudIo, SavedCloudsComeBackBitForBit)
{
  const std::string folder = freshFolder("cloud_io_round_trip");
  for (const bool ascii : {false, true}) {
    const RangeCloud cloud = bowlCloud(kWidth, kHeight, test::tiltedPose(), true);
    saveCloud(folder + "/cloud.pcd", cloud, ascii);
    CloudFileInfo info;
    const RangeCloud loaded = loadCloud(folder + "/cloud.pcd", {}, &info);
    expectSamePoints(cloud, loaded, 0.0F);
    ASSERT_TRUE(loaded.covariances);
    ASSERT_EQ(loaded.covariances->size(), cloud.covariances->size());
    for (std::size_t i = 0; i < cloud.covariances->size(); ++i)
      // The six numbers of the file are the upper triangle.
      EXPECT_EQ(
          Eigen::Matrix3f((*loaded.covariances)[i].triangularView<Eigen::Upper>()),
          Eigen::Matrix3f((*cloud.covariances)[i].triangularView<Eigen::Upper>()));
    // VIEWPOINT has 9 digits.
    EXPECT_TRUE(loaded.sensor_pose.R.isApprox(cloud.sensor_pose.R, 1e-8));
    EXPECT_TRUE(loaded.sensor_pose.c.isApprox(cloud.sensor_pose.c, 1e-8));
    EXPECT_FALSE(loaded.points->is_dense);
    EXPECT_EQ(info.format, ascii ? "PCD ascii" : "PCD binary");
    EXPECT_EQ(info.fields, (std::vector<std::string>{"x", "y", "z", "covariance"}));
    EXPECT_EQ(test::filesIn(folder), std::vector<std::string>{"cloud.pcd"});
  }
}

TEST(CloudIo, EveryFormatGivesTheSameCloud)
{
  const std::string folder = freshFolder("cloud_io_formats");
  const RangeCloud cloud = bowlCloud(kWidth, kHeight);
  for (const auto& [name, bytes] : everyFormat(folder)) {
    SCOPED_TRACE(name);
    if (name.find("covariance") != std::string::npos)
      continue; // in another frame
    writeFile(folder + "/" + name, bytes);
    const RangeCloud loaded = loadCloud(folder + "/" + name, smallOptions());
    const bool is_ply = name.find(".ply") != std::string::npos;
    const bool is_image = name.find("depth") == 0;
    // Half a unit of depth, to which x and y are in proportion.
    const float tolerance = is_image ? 0.51F / static_cast<float>(kScale) : 0.0F;
    if (!is_ply) {
      expectSamePoints(cloud, loaded, tolerance);
      continue;
    }
    ASSERT_EQ(loaded.points->size() + 1, cloud.points->size()); // without the NaN
    EXPECT_EQ(loaded.points->height, 1U);
    for (std::size_t i = 0; i < loaded.points->size(); ++i)
      EXPECT_EQ((*loaded.points)[i].getVector3fMap(),
                (*cloud.points)[i + 1].getVector3fMap());
  }
}

TEST(CloudIo, BigEndianPly)
{
  const std::string folder = freshFolder("cloud_io_big_endian");
  const RangeCloud cloud = bowlCloud(kWidth, kHeight);
  std::string bytes = test::plyBytes<float>(cloud, "binary_big_endian");
  // Without the faces, whose indices the helper writes little endian.
  bytes.resize(bytes.size() - 13);
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  bytes.erase(bytes.find(faces), faces.size());
  writeFile(folder + "/big.ply", bytes);
  const RangeCloud loaded = loadCloud(folder + "/big.ply");
  EXPECT_EQ((*loaded.points)[5].getVector3fMap(), (*cloud.points)[6].getVector3fMap());
}

TEST(CloudIo, OldAndUnusualPcd)
{
  const std::string folder = freshFolder("cloud_io_old_pcd");
  const std::string path = folder + "/old.pcd";
  // v.7 without VIEWPOINT, COUNT and POINTS; DOS line ends; an integer and an array
  // among the fields; nan, plus signs and exponents among the numbers.
  writeFile(path,
            "# .PCD v.7 - Point Cloud Data file format\r\nVERSION .7\r\n"
            "FIELDS rgb z hist y x\r\nSIZE 4 4 4 8 4\r\nTYPE U F F F F\r\n"
            "COUNT 1 1 3 1 1\r\nWIDTH 2\r\nDATA ascii\r\n"
            "255 1.5 9 9 9 +2 -3e-1\r\n\r\n0 nan 9 9 9 nan nan\r\n");
  CloudFileInfo info;
  const RangeCloud cloud = loadCloud(path, {}, &info);
  ASSERT_EQ(cloud.points->size(), 2U);
  EXPECT_EQ((*cloud.points)[0].getVector3fMap(), Eigen::Vector3f(-0.3F, 2.0F, 1.5F));
  EXPECT_EQ(countValidPoints(cloud), 1);
  EXPECT_FALSE(info.viewpoint.has_value());
  EXPECT_TRUE(cloud.sensor_pose.R.isIdentity());
}

TEST(CloudIo, PlyCameraIsTheSensorPose)
{
  const std::string folder = freshFolder("cloud_io_ply_camera");
  const Pose pose = test::tiltedPose();
  const RangeCloud cloud = bowlCloud(kWidth, kHeight, pose);
  std::string bytes = test::plyBytes<float>(cloud, "ascii");
  std::string element = "element camera 1\n";
  std::string row;
  const char* const names[] = {"view_px",
                               "view_py",
                               "view_pz",
                               "x_axisx",
                               "x_axisy",
                               "x_axisz",
                               "y_axisx",
                               "y_axisy",
                               "y_axisz",
                               "z_axisx",
                               "z_axisy",
                               "z_axisz"};
  for (int i = 0; i < 12; ++i) {
    element += std::string("property float ") + names[i] + "\n";
    const double value = i < 3 ? pose.c(i) : pose.R((i - 3) / 3, (i - 3) % 3);
    row += std::to_string(value) + " ";
  }
  bytes.insert(bytes.find("end_header"), element);
  writeFile(folder + "/camera.ply", bytes + row + "\n");
  const RangeCloud loaded = loadCloud(folder + "/camera.ply");
  EXPECT_TRUE(loaded.sensor_pose.R.isApprox(pose.R, 1e-5)); // six digits
  EXPECT_TRUE(loaded.sensor_pose.c.isApprox(pose.c, 1e-5));
}

TEST(CloudIo, TruncatedFilesAreErrors)
{
  const std::string folder = freshFolder("cloud_io_truncated");
  for (const auto& [name, bytes] : everyFormat(folder)) {
    const bool is_text = name.find("ascii") != std::string::npos;
    // Without its last digit or line end a text is still a cloud: stop before the last
    // word.
    std::size_t end = bytes.size();
    if (is_text)
      end = bytes.find_last_of(" \n", bytes.size() - 2) + 1;
    for (std::size_t n = 0; n < end; n = n < 400 ? n + 1 : n + 13) {
      const std::string cut = bytes.substr(0, n);
      EXPECT_NE(complaint(folder + "/" + name, cut), "")
          << name << " cut to " << n << " of " << bytes.size() << " bytes";
    }
  }
}

TEST(CloudIo, FlippedBytesNeverCrash)
{
  const std::string folder = freshFolder("cloud_io_flipped");
  for (const auto& [name, bytes] : everyFormat(folder)) {
    SCOPED_TRACE(name);
    test::Random random(std::hash<std::string>{}(name));
    // Everywhere in the header, then at random.
    for (std::size_t trial = 0; trial < 600; ++trial) {
      std::string flipped = bytes;
      const auto last = static_cast<int>(bytes.size()) - 1;
      const std::size_t place = trial < 300 ?
                                    std::min<std::size_t>(trial, bytes.size() - 1) :
                                    static_cast<std::size_t>(random.integer(0, last));
      flipped[place] = static_cast<char>(flipped[place] ^ (1 << random.integer(0, 7)));
      complaint(folder + "/" + name, flipped); // either is fine, a crash is not
    }
  }
}

TEST(CloudIo, PngChecksumsGuardEveryByte)
{
  const std::string folder = freshFolder("cloud_io_png");
  const std::string bytes = test::pngBytes(bowlCloud(kWidth, kHeight), kScale);
  const std::size_t header_end = 33; // signature and IHDR with its checksum
  for (std::size_t i = 12; i < header_end; ++i) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ 1);
    EXPECT_NE(complaint(folder + "/flipped.png", flipped), "") << "byte " << i;
  }
}

TEST(CloudIo, AbsurdSizesAllocateNothing)
{
  const std::string folder = freshFolder("cloud_io_absurd");
  const std::string header = "# .PCD v0.7\nVERSION 0.7\n";
  const std::string rest = "HEIGHT 1\nDATA ";
  const std::string zeros(64, '\0');
  for (const std::string data : {"ascii\n", "binary\n", "binary_compressed\n"})
    for (const std::string width : {"2000000000",
                                    "4294967296",
                                    "18446744073709551615",
                                    "1e9",
                                    "-1",
                                    "9999999999999999999999"}) {
      const std::string text =
          header + test::kXyzFields + "WIDTH " + width + "\n" + rest + data + zeros;
      EXPECT_NE(complaint(folder + "/wide.pcd", text), "") << width << data;
    }
  EXPECT_NE(complaint(folder + "/count.pcd",
                      header +
                          "FIELDS x y z h\nSIZE 4 4 4 8\nTYPE F F F F\n"
                          "COUNT 1 1 1 99999999999\nWIDTH 9\n" +
                          rest + "binary\n" + zeros),
            "");
  for (const std::string format : {"ascii", "binary_little_endian"})
    EXPECT_NE(complaint(folder + "/vertices.ply",
                        "ply\nformat " + format +
                            " 1.0\nelement vertex 4000000000\nproperty float x\n"
                            "property float y\nproperty float z\nend_header\n" +
                            zeros),
              "");
  EXPECT_NE(complaint(folder + "/list.ply",
                      "ply\nformat binary_little_endian 1.0\nelement face 1\n"
                      "property list uint int i\nelement vertex 1\nproperty float x\n"
                      "property float y\nproperty float z\nend_header\n"
                      "\xff\xff\xff\xff" +
                          zeros),
            "");
  EXPECT_NE(complaint(folder + "/big.pgm", "P5 4000000000 4000000000 65535\n" + zeros),
            "");
  EXPECT_NE(complaint(folder + "/flat.pgm", "P5 4000000000 0 65535\n"), "");
}

TEST(CloudIo, ErrorsNameTheCause)
{
  const std::string folder = freshFolder("cloud_io_causes");
  const auto xyz = [](const std::string& rows, int n) {
    return test::pcdHeader(test::kXyzFields, n, 1, "ascii") + rows;
  };
  const std::map<std::string, std::pair<std::string, std::string>> cases{
      {"empty.pcd", {"", "is empty"}},
      {"strange.xyz", {"1 2 3\n", "neither PCD"}},
      {"nan.pcd", {xyz("nan nan nan\n", 1), "no valid point"}},
      {"none.pcd", {xyz("", 0), "no points"}},
      {"short_row.pcd", {xyz("1.5 2.5 3.5\n1 2\n", 2), "point 1 has 2 values"}},
      {"word.pcd", {xyz("1 2 x\n", 1), "not a number"}},
      {"fields.pcd",
       {test::pcdHeader("FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1\n", 1, 1, "ascii") +
            "1 2\n",
        "no fields x, y and z"}},
      {"type.pcd",
       {test::pcdHeader("FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\n", 1, 1, "ascii"),
        "TYPE and SIZE"}},
      {"covariance.pcd",
       {test::pcdHeader("FIELDS x y z covariance\nSIZE 4 4 4 4\nTYPE F F F F\n"
                        "COUNT 1 1 1 7\n",
                        1,
                        1,
                        "ascii"),
        "COUNT 7, not 6"}},
      {"far.pcd",
       {test::pcdHeader(test::kXyzFields + "VIEWPOINT -1.5e308 0 0 1 0 0 0\n",
                        1,
                        1,
                        "ascii") +
            "1.5e308 2 3\n",
        "viewpoint must be finite"}},
      {"data.pcd", {test::pcdHeader(test::kXyzFields, 1, 1, "base64"), "DATA"}},
      {"no_xyz.ply",
       {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
        "no properties x, y and z"}},
      {"bytes.pgm", {"P5 2 2 255\n1234", "not 16-bit"}},
      {"text.png", {"no image at all", "PNG"}},
  };
  for (const auto& [name, content] : cases)
    EXPECT_NE(complaint(folder + "/" + name, content.first).find(content.second),
              std::string::npos)
        << name << ": " << complaint(folder + "/" + name, content.first);
  EXPECT_THROW(loadCloud(folder), std::runtime_error);
  EXPECT_THROW(loadCloud(folder + "/missing.pcd"), std::runtime_error);
  EXPECT_THROW(loadCloud("/dev/zero"), std::runtime_error);
}

TEST(CloudIo, DepthScaleAndImageSize)
{
  const std::string folder = freshFolder("cloud_io_depth");
  const std::string path = folder + "/depth.pgm";
  writeFile(path, test::pgmBytes(bowlCloud(kWidth, kHeight), kScale));
  LoadOptions options = smallOptions();
  options.min_range_m = 0.5;
  options.max_range_m = 8.0;
  EXPECT_NO_THROW(loadCloud(path, options));
  options.depth_scale = 1.0; // every point some kilometres away
  EXPECT_THROW(loadCloud(path, options), std::runtime_error);
  for (const double scale : {0.0, -1.0, std::nan("")}) {
    options.depth_scale = scale;
    EXPECT_THROW(loadCloud(path, options), std::invalid_argument);
  }
  // A camera of twice the resolution sees the same rays through its pixels.
  options = smallOptions();
  options.camera = test::smallCamera(2 * kWidth, 2 * kHeight);
  options.camera.fx *= 2.0;
  options.camera.fy *= 2.0;
  const RangeCloud halved = loadCloud(path, options);
  expectSamePoints(loadCloud(path, smallOptions()), halved, 1e-6F); // float rounding
  options.camera.width += 7;
  EXPECT_THROW(loadCloud(path, options), std::runtime_error);
}

TEST(CloudIo, InvalidCovariancesAreCountedNotDropped)
{
  const std::string folder = freshFolder("cloud_io_covariances");
  RangeCloud cloud = bowlCloud(kWidth, kHeight, {}, true);
  Covariances& covariances = test::ownCovariances(cloud);
  covariances[0].setConstant(std::nanf("")); // of the NaN point: does not count
  covariances[5](0, 0) = std::nanf("");
  covariances[6] *= -1.0F;
  covariances[7](0, 1) = covariances[7](1, 0) = 1.0F;
  saveCloud(folder + "/bad.pcd", cloud);
  const RangeCloud loaded = loadCloud(folder + "/bad.pcd");
  EXPECT_EQ(loaded.covariances->size(), covariances.size());
  EXPECT_EQ(countInvalidCovariances(loaded), 3);
  EXPECT_EQ(countValidPoints(loaded), kWidth * kHeight - 1);
}

TEST(CloudIo, FailedSavesLeaveNothingBehind)
{
  const std::string folder = freshFolder("cloud_io_unwritable");
  const RangeCloud cloud = bowlCloud(kWidth, kHeight);
  EXPECT_THROW(saveCloud(folder + "/no/such/folder.pcd", cloud), std::runtime_error);
  EXPECT_THROW(saveCloud(folder, cloud), std::runtime_error);
  RangeCloud broken = cloud;
  test::ownCovariances(broken).resize(3);
  EXPECT_THROW(saveCloud(folder + "/broken.pcd", broken), std::invalid_argument);
  EXPECT_TRUE(test::filesIn(folder).empty());
}

TEST(CloudIo, CloudFilesOfAFolder)
{
  const std::string folder = freshFolder("cloud_io_is_cloud");
  const std::string png = test::pngBytes(bowlCloud(kWidth, kHeight), kScale);
  writeFile(folder + "/depth.png", png);
  std::string color = png;
  color[25] = 2; // colour type RGB
  writeFile(folder + "/color.png", color);
  EXPECT_TRUE(isCloudFile(folder + "/depth.png"));
  EXPECT_FALSE(isCloudFile(folder + "/color.png"));
  EXPECT_TRUE(isCloudFile("a.PCD"));
  EXPECT_TRUE(isCloudFile("a.ply"));
  EXPECT_FALSE(isCloudFile("a.patches.ply"));
  EXPECT_FALSE(isCloudFile("folder/a.patches.pcd"));
  EXPECT_FALSE(isCloudFile("a.txt"));
}

TEST(CloudIo, RecordedClouds)
{
  const std::map<std::string, std::pair<std::uint32_t, std::uint32_t>> clouds{
      {"gpd_krylon_can.pcd", {4467, 1}},
      {"mosd_cyl_learn44.pcd", {640, 480}},
      {"pcl_table_mug_stereo.pcd", {640, 480}},
      {"pcl_lamppost_mls.pcd", {1771, 1}},
      {"otira_rocks_west.ply", {48426, 1}},
      {"rosind_table_boxes.pcd", {23239, 1}},
      {"tum_fr2desk_depth.png", {640, 480}}};
  LoadOptions options;
  options.depth_scale = 5000.0;
  for (const auto& [name, size] : clouds) {
    const std::string path = test::recordedCloud(name);
    if (path.empty())
      GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
    const RangeCloud cloud = loadCloud(path, options);
    EXPECT_EQ(cloud.points->width, size.first) << name;
    EXPECT_EQ(cloud.points->height, size.second) << name;
    EXPECT_GT(countValidPoints(cloud), static_cast<int>(size.first / 2)) << name;
  }
}

TEST(CloudIo, ColorsComeWhereTheyAreAskedFor)
{
  const std::string folder = freshFolder("colors");
  const auto pcd = [](const std::string& name, char type, const std::string& values) {
    return "VERSION .7\nFIELDS x y z " + name + "\nSIZE 4 4 4 4\nTYPE F F F " + type +
           "\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA " + values;
  };
  // 0xff102030, all bits of a NaN, as PCL writes opaque colours; and 0x405060.
  const std::string binary = test::rawBytes(1.0F) + test::rawBytes(1.0F) +
                             test::rawBytes(1.0F) + test::rawBytes(0xff102030U) +
                             test::rawBytes(2.0F) + test::rawBytes(1.0F) +
                             test::rawBytes(1.0F) + test::rawBytes(0x405060U);
  const std::map<std::string, std::string> files{
      {"float.pcd", pcd("rgb", 'F', "binary\n" + binary)},
      {"rgba.pcd", pcd("rgba", 'U', "binary\n" + binary)},
      {"integer.pcd", pcd("rgb", 'U', "ascii\n1 1 1 4279246896\n2 1 1 4214880\n")},
      {"text.pcd",
       pcd("rgb",
           'F',
           "ascii\n1 1 1 1.480914637873896e-39\n2 1 1 5.906304871313385e-39\n")},
      {"bytes.ply",
       "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
       "property float z\nproperty uchar red\nproperty uchar green\n"
       "property uchar blue\nend_header\n1 1 1 16 32 48\n2 1 1 64 80 96\n"}};
  using Colors = std::vector<std::array<std::uint8_t, 3>>;
  for (const auto& [name, bytes] : files) {
    writeFile(folder + '/' + name, bytes);
    CloudFileInfo info;
    LoadOptions options;
    EXPECT_EQ(loadCloud(folder + '/' + name, options, &info).points->size(), 2U);
    EXPECT_TRUE(info.colors.empty()) << name;
    options.colors = true;
    loadCloud(folder + '/' + name, options, &info);
    EXPECT_EQ(info.colors, (Colors{{16, 32, 48}, {64, 80, 96}})) << name;
  }
}

}} // namespace holdfast
