/// \file Clouds as people bring them: old headers, odd types, line ends, surplus,
/// numbers.
#include <holdfast/io/cloud_io.h>

#include "support/random.h"
#include "support/run_program.h"
#include "support/small_clouds.h"

#include <pcl/common/point_tests.h>
#include <pcl/io/pcd_io.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace holdfast { namespace {

using test::rawBytes;

const std::vector<Eigen::Vector3f> kPoints{{0.11F, 0.21F, 1.01F},
                                           {0.12F, -0.22F, 1.02F},
                                           {-0.13F, 0.23F, 1.03F},
                                           {0.14F, 0.24F, 1.04F}};
const std::string kRows =
    "0.11 0.21 1.01\n0.12 -0.22 1.02\n-0.13 0.23 1.03\n0.14 0.24 1.04\n";
const std::string kSizes = "SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
const std::string kFour = "WIDTH 4\nHEIGHT 1\nPOINTS 4\n";

std::string
replaced(std::string text, const std::string& from, const std::string& to)
{
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

/// The four points as binary data.
std::string
binaryRows(const std::string& behind_each = {})
{
  std::string bytes;
  for (const Eigen::Vector3f& q : kPoints)
    bytes += rawBytes(q.x()) + rawBytes(q.y()) + rawBytes(q.z()) + behind_each;
  return bytes;
}

std::string
asciiPcd(const std::string& fields = "FIELDS x y z\n" + kSizes,
         const std::string& rows = kRows)
{
  return "# .PCD v0.7\nVERSION 0.7\n" + fields + kFour + "DATA ascii\n" + rows;
}

std::string
asciiPly(const std::string& more_header = {}, const std::string& rows = kRows)
{
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\n" +
         more_header + "end_header\n" + rows;
}

struct Loaded {
  RangeCloud cloud;
  CloudFileInfo info;

  std::string notices() const
  {
    std::string all;
    for (const std::string& notice : info.notices)
      all += notice + "\n";
    return all;
  }
};

class CloudDialects : public ::testing::Test {
protected:
  Loaded load(const std::string& bytes,
              const LoadOptions& options = {},
              const std::string& name = "cloud")
  {
    const std::string path = folder_ + "/" + name;
    test::writeFile(path, bytes);
    Loaded loaded;
    loaded.cloud = loadCloud(path, options, &loaded.info);
    return loaded;
  }

  /// What is said about these bytes; empty when they are read.
  std::string complaint(const std::string& bytes, const LoadOptions& options = {})
  {
    try {
      load(bytes, options);
      return {};
    }
    catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  void expectFour(const std::string& bytes, const std::string& notice = {})
  {
    Loaded loaded;
    ASSERT_NO_THROW(loaded = load(bytes)) << complaint(bytes);
    ASSERT_EQ(loaded.cloud.points->size(), kPoints.size());
    for (std::size_t i = 0; i < kPoints.size(); ++i)
      EXPECT_EQ((*loaded.cloud.points)[i].getVector3fMap(), kPoints[i]) << i;
    if (notice.empty())
      EXPECT_EQ(loaded.notices(), "");
    else
      EXPECT_NE(loaded.notices().find(notice), std::string::npos) << loaded.notices();
  }

  void TearDown() override
  {
    std::filesystem::remove_all(folder_);
  }

  std::string folder_ = test::freshFolder(
      std::string("dialects_") +
      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(CloudDialects, HeadersBeforeWidthAndTypes)
{
  expectFour("# .PCD v.6\nVERSION .6\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 4\n"
             "DATA ascii\n" +
             kRows);
  expectFour("# .PCD v.5\nVERSION .5\nCOLUMNS x y z\nPOINTS 4\nDATA ascii\n" + kRows);
  expectFour("COLUMNS x y z\nPOINTS 4\nDATA binary\n" + binaryRows());
  expectFour("VERSION 0.7\nFIELDS x y z\n" + kSizes + "WIDTH 4\nDATA ascii\n" + kRows);
  expectFour("VERSION 0.7\nFIELDS x y z\n" + kSizes +
             "WIDTH 4\nHEIGHT 0\nPOINTS 4\nDATA ascii\n" + kRows);
  EXPECT_NE(complaint("VERSION 0.7\nFIELDS x y z\nDATA ascii\n" + kRows), "");
}

TEST_F(CloudDialects, FieldTypes)
{
  const std::string with_empty =
      "FIELDS x y z _ label\nSIZE 4 4 4 1 2\nTYPE F F F U U\n"
      "COUNT 1 1 1 0 1\n";
  expectFour("# .PCD\nVERSION 0.7\n" + with_empty + kFour + "DATA binary\n" +
             binaryRows("\1\2"));
  expectFour(asciiPcd(with_empty, replaced(kRows, "\n", " 7\n")));
  expectFour(asciiPcd("FIELDS x y z\nSIZE 4 4 4\nTYPE f f f\nCOUNT 1 1 1\n"));
  expectFour(asciiPcd("FIELDS x y z ok\nSIZE 4 4 4 1\nTYPE F F F B\n",
                      replaced(kRows, "\n", " 1\n")));
  expectFour(replaced(asciiPcd(), "DATA ascii", "DATA ASCII"));
  for (const std::string type : {"bool", "int64", "uint64", "double"})
    expectFour(
        asciiPly("property " + type + " extra\n", replaced(kRows, "\n", " 1\n")));
  const std::string binary =
      replaced(asciiPly("property int64 t\nproperty bool b\n", ""),
               "ascii",
               "binary_little_endian");
  expectFour(binary + binaryRows(std::string(8, '\3') + "\1"));
  // Without its size, nothing behind it can be found.
  EXPECT_NE(complaint(replaced(binary, "int64", "decimal") + binaryRows("123456789"))
                .find("unknown type"),
            std::string::npos);
}

TEST_F(CloudDialects, SurplusIsLeftAlone)
{
  const std::string binary =
      "VERSION 0.7\nFIELDS x y z\n" + kSizes + kFour + "DATA binary\n";
  expectFour(asciiPcd("FIELDS x y z\n" + kSizes, kRows + kRows + "1 2 3\n"),
             "5 more rows");
  expectFour(asciiPcd("FIELDS x y z\n" + kSizes, replaced(kRows, "\n", " 9 9\n")),
             "rows of up to 5 values");
  for (const std::string rest : {"x", "1234", "12345678", "some text\n"})
    expectFour(binary + binaryRows() + rest, "behind the last point");
  expectFour(binary + binaryRows() + binaryRows(), "behind the last point");
  expectFour(binary + binaryRows() + std::string(4096, '\0')); // padding
  expectFour(asciiPly({}, kRows + kRows), "not used");
  expectFour(replaced(asciiPly({}, ""), "ascii", "binary_little_endian") +
                 binaryRows() + "rest",
             "4 bytes behind the data");
  // Rows of another width: the values would land in the wrong columns.
  EXPECT_NE(
      complaint(asciiPly({}, replaced(kRows, "\n", " 255\n"))).find("more values"),
      std::string::npos);
  std::string wide = "VERSION 0.7\nFIELDS x y z\nWIDTH 2000\nDATA binary\n";
  for (int i = 0; i < 500; ++i)
    wide += binaryRows("\1\2\3\4");
  EXPECT_NE(complaint(wide).find("16 bytes of data per point"), std::string::npos);
  std::string padded = "VERSION 0.7\nFIELDS x y z\nWIDTH 2000\nDATA binary\n";
  for (int i = 0; i < 500; ++i)
    padded += binaryRows();
  EXPECT_EQ(load(padded + std::string(8000, '\0')).notices(), "");
}

TEST_F(CloudDialects, LineEndsAndMagic)
{
  for (const std::string& text : {asciiPcd(), asciiPly()}) {
    expectFour(replaced(text, "\n", "\r\n"));
    expectFour(replaced(text, "\n", "\r"));
    expectFour("\xef\xbb\xbf" + text);
    expectFour("\n\r\n  \n" + text);
    expectFour(text.substr(0, text.size() - 1)); // no line end at the end
  }
  expectFour(replaced(asciiPly(), "ply\n", "ply \t\n"));
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::string pcd =
        "VERSION 0.7\nFIELDS x y z\n" + kSizes + kFour + "DATA binary\n";
    expectFour(replaced(pcd, "\n", end) + binaryRows());
    const std::string ply = replaced(asciiPly({}, ""), "ascii", "binary_little_endian");
    expectFour(replaced(ply, "\n", end) + binaryRows());
  }
}

TEST_F(CloudDialects, WiderBinaryRowsThanAnnouncedAreRefused)
{
  test::Random random;
  for (const std::size_t wider : {1U, 4U, 12U}) { // another type, padding, doubles
    std::string bytes;
    for (int i = 0; i < 1200; ++i) {
      for (int k = 0; k < 3; ++k)
        bytes += rawBytes(static_cast<float>(random.uniform(0.5, 1.0)));
      bytes += std::string(wider, 'x');
    }
    const auto with1200 = [](const std::string& text) {
      return replaced(replaced(text, "WIDTH 4", "WIDTH 1200"),
                      "POINTS 4",
                      "POINTS 1200");
    };
    const std::string pcd = with1200(
        replaced(asciiPcd("FIELDS x y z\n" + kSizes, ""), "DATA ascii", "DATA binary"));
    EXPECT_NE(complaint(pcd + bytes).find("corrupt: "), std::string::npos) << wider;
    const std::string ply =
        replaced(replaced(asciiPly({}, ""), "ascii", "binary_little_endian"),
                 "vertex 4",
                 "vertex 1200");
    EXPECT_NE(complaint(ply + bytes).find("corrupt: "), std::string::npos) << wider;
  }
}

TEST_F(CloudDialects, ColumnsNobodyUsesNeedNoNumbers)
{
  std::string rows = "0xff " + replaced(kRows, "\n", " chair\n0xff ");
  rows.resize(rows.size() - 5); // the start of a fifth row
  expectFour(asciiPcd("FIELDS label x y z name\n", rows));
  expectFour(asciiPly("property string name\n", replaced(kRows, "\n", " chair\n")));
  EXPECT_NE(complaint(asciiPcd("FIELDS x y z\n", replaced(kRows, "1.03", "0xff"))), "");
  EXPECT_NE(complaint(asciiPly({}, replaced(kRows, "1.03", "chair"))), "");
}

TEST_F(CloudDialects, NumbersBeyondTheirType)
{
  const auto first = [&](const std::string& word) {
    const std::string rows = replaced(kRows, "0.11", word);
    const float pcd = (*load(asciiPcd("FIELDS x y z\n", rows)).cloud.points)[0].x;
    const float ply = (*load(asciiPly({}, rows)).cloud.points)[0].x;
    EXPECT_EQ(std::isnan(pcd), std::isnan(ply)) << word;
    return pcd;
  };
  for (const std::string& small :
       std::vector<std::string>{"1e-400",
                                "-1e-400",
                                "1e-99999",
                                "0." + std::string(400, '0') + "1"})
    EXPECT_EQ(first(small), 0.0F) << small;
  for (const std::string& none : std::vector<std::string>{"1e400",
                                                          "-1e400",
                                                          "1e39",
                                                          "1" + std::string(400, '0'),
                                                          "inf",
                                                          "-Infinity",
                                                          "nan",
                                                          "-nan",
                                                          "NaN",
                                                          "nan(ind)",
                                                          "-nan(ind)",
                                                          "-nan(snan)",
                                                          "1.#QNAN",
                                                          "1.#QNAN0",
                                                          "-1.#IND",
                                                          "-1.#IND00",
                                                          "1.#INF",
                                                          "-1.#INF000",
                                                          "1.#SNAN"})
    EXPECT_TRUE(std::isnan(first(none))) << none;
  EXPECT_EQ(first("+0.5"), 0.5F);
  for (const std::string word : {"1.#", "nan(", "1e", "--1", "1,5", ""})
    EXPECT_NE(complaint(asciiPcd("FIELDS x y z\n", replaced(kRows, "0.11", word))), "")
        << word;
}

TEST_F(CloudDialects, UnknownHeaderLinesAreIgnored)
{
  expectFour(replaced(asciiPcd(), "WIDTH", "ORIGIN lab\nWIDTH"), "'ORIGIN'");
  expectFour(asciiPly("texture_file a.jpg\nproj utm\n"), "2 unknown header lines");
  expectFour(replaced(asciiPcd(), "WIDTH", "VIEWPOINT 0 0 0\nWIDTH"),
             "VIEWPOINT is not a pose");
  // Nothing of the file can steer the terminal.
  EXPECT_EQ(load(asciiPly("\x1b[2Jx\n")).notices().find('\x1b'), std::string::npos);
}

TEST_F(CloudDialects, StrangersAreNamed)
{
  const std::map<std::string, std::string> strangers{
      {"version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 99\n",
       "a Git LFS pointer, not the file itself"},
      {"\n<!DOCTYPE HTML><html>", "a web page, not the file itself"},
      {"<html><body>", "a web page, not the file itself"},
      {std::string("\x1f\x8b\x08\0", 4), "packed by gzip"},
      {std::string("PK\x03\x04") + "abc", "packed by zip"},
      {"LASF\1\2", "a LAS or LAZ file"},
      {std::string("II*\0\b", 5), "a TIFF image"},
      {std::string("\x93NUMPY\1\0", 8), "a NumPy array"},
      {"P6 2 1 255\nabcdef", "a colour image"},
      {"{\"message\": \"Not Found\"}", ", but JSON"},
      {"1.0 2.0 3.0\n", ", but a table of numbers"}};
  for (const auto& [bytes, name] : strangers)
    for (const std::string file : {"a.pcd", "a.ply", "a.png", "a"}) {
      try {
        load(bytes, {}, file);
        ADD_FAILURE() << file << name;
      }
      catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos)
            << error.what();
      }
    }
}

TEST_F(CloudDialects, OtherTextIsNamed)
{
  const std::map<std::string, std::string> texts{
      {"0.1 0.2 1.0\n0.2 0.2 1.0\n", ", but a table of numbers"},
      {"\n0.1,\t-2e-1,1.0,255\r\n", ", but a table of numbers"},
      {"v 0.1 0.2 1.0\n", ", but OBJ"},
      {"solid x\nfacet normal 0 0 1\n", ", but STL"},
      {"1 2\n", "is neither PCD, PLY, 16-bit PNG nor PGM"},
      {"x,y,z\n1,2,3\n", "is neither PCD, PLY, 16-bit PNG nor PGM"}};
  for (const auto& [bytes, name] : texts)
    EXPECT_NE(complaint(bytes).find(name), std::string::npos) << complaint(bytes);
}

TEST_F(CloudDialects, BytesInAnotherOrderAreDoubted)
{
  std::string bytes;
  for (const Eigen::Vector3f& q : kPoints)
    for (const float x : q) {
      const std::string number = rawBytes(x);
      bytes.append(number.rbegin(), number.rend());
    }
  const std::string pcd = replaced(asciiPcd({"FIELDS x y z\n" + kSizes}, bytes),
                                   "DATA ascii",
                                   "DATA binary");
  EXPECT_NE(load(pcd).notices().find("bytes in another order"), std::string::npos);
}

TEST_F(CloudDialects, NamesInCapitals)
{
  expectFour(asciiPcd("FIELDS X Y Z\n" + kSizes));
  expectFour(replaced(
      replaced(replaced(asciiPly(), "float x", "float X"), "float y", "float Y"),
      "float z",
      "float Z"));
  // Small letters win.
  expectFour(asciiPcd("FIELDS x y z X\n", replaced(kRows, "\n", " 7\n")));
  EXPECT_NE(complaint(asciiPcd("FIELDS x y z x\n", replaced(kRows, "\n", " 7\n"))), "");
}

TEST_F(CloudDialects, CovariancesOfNineNumbers)
{
  const std::string fields =
      "FIELDS x y z covariance\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 9\n";
  const std::string nine = " 1e-6 2e-7 3e-7 2e-7 4e-6 5e-7 3e-7 5e-7 9e-6\n";
  const RangeCloud cloud = load(asciiPcd(fields, replaced(kRows, "\n", nine))).cloud;
  ASSERT_TRUE(cloud.covariances);
  ASSERT_EQ(cloud.covariances->size(), 4U);
  Eigen::Matrix3f expected;
  expected << 1e-6F, 2e-7F, 3e-7F, 2e-7F, 4e-6F, 5e-7F, 3e-7F, 5e-7F, 9e-6F;
  for (const Eigen::Matrix3f& covariance : *cloud.covariances)
    EXPECT_EQ(covariance, expected);
  EXPECT_NE(
      complaint(
          asciiPcd(
              fields,
              replaced(kRows, "\n", " 1e-6 2e-7 3e-7 9e-7 4e-6 5e-7 3e-7 5e-7 9e-6\n")))
          .find("not symmetric"),
      std::string::npos);
}

TEST_F(CloudDialects, GridsOfPlyFiles)
{
  const auto expectGrid = [this](const std::string& bytes) {
    const Loaded loaded = load(bytes);
    EXPECT_EQ(loaded.cloud.points->width, 2U);
    EXPECT_EQ(loaded.cloud.points->height, 2U);
    EXPECT_EQ(loaded.notices(), "");
    EXPECT_EQ((*loaded.cloud.points)(0, 1).getVector3fMap(), kPoints[2]);
  };
  expectGrid(asciiPly("obj_info num_cols 2\nobj_info num_rows 2\n"));
  expectGrid(asciiPly("comment viewportx 2\ncomment viewporty 2\n"));
  expectGrid(asciiPly(
      "element camera 1\nproperty int viewportx\nproperty int viewporty\n"
      "property float view_px\nproperty float view_py\nproperty float view_pz\n"
      "property float x_axisx\nproperty float x_axisy\nproperty float x_axisz\n"
      "property float y_axisx\nproperty float y_axisy\nproperty float y_axisz\n"
      "property float z_axisx\nproperty float z_axisy\nproperty float z_axisz\n",
      kRows + "2 2 0 0 0 1 0 0 0 1 0 0 0 1\n"));
  expectGrid(asciiPly("obj_info num_cols 2\nobj_info num_rows 2\nelement range_grid 4\n"
                      "property list uchar int vertex_indices\n",
                      kRows + "1 0\n1 1\n1 2\n1 3\n"));
  const std::string grid =
      "obj_info num_cols 3\nobj_info num_rows 2\nelement range_grid 6\n"
      "property list uchar int vertex_indices\n";
  const Loaded sparse = load(asciiPly(grid, kRows + "1 0\n0\n1 1\n0\n1 2\n1 3\n"));
  EXPECT_EQ(sparse.cloud.points->width, 3U);
  EXPECT_EQ(countValidPoints(sparse.cloud), 4);
  EXPECT_EQ((*sparse.cloud.points)(1, 1).getVector3fMap(), kPoints[2]);
  EXPECT_NE(load(asciiPly(grid, kRows + "1 0\n0\n1 1\n0\n1 2\n0\n"))
                .notices()
                .find("in no cell of range_grid, left out: 1"),
            std::string::npos);
  EXPECT_NE(complaint(asciiPly(grid, kRows + "1 0\n0\n1 1\n0\n1 2\n1 4\n")), "");
  EXPECT_NE(complaint(asciiPly(grid, kRows + "1 0\n0\n1 1\n0\n1 2\n")), "");
  // Nonsense is not a grid.
  const Loaded wrong = load(asciiPly("obj_info num_cols 3\nobj_info num_rows 2\n"));
  EXPECT_EQ(wrong.cloud.points->height, 1U);
  EXPECT_NE(wrong.notices().find("not organized"), std::string::npos);
}

TEST_F(CloudDialects, WhatPclReadsIsReadAlike)
{
  const std::string bin = "FIELDS x y z\n" + kSizes + kFour + "DATA binary\n";
  const std::vector<std::string> files{
      asciiPcd(),
      asciiPcd("COLUMNS x y z\n" + kSizes),
      asciiPcd("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"),
      asciiPcd("FIELDS x y z\n" + kSizes, replaced(kRows, "\n", " \r\n")),
      asciiPcd("FIELDS x y z\n" + kSizes, kRows + kRows),
      asciiPcd("FIELDS z rgb x y\nSIZE 4 4 4 4\nTYPE F U F F\nCOUNT 1 1 1 1\n",
               "1 7 2 3\n4 7 5 6\n7 7 8 9\n1 7 2 nan\n"),
      replaced(asciiPcd(), "HEIGHT 1\n", ""),
      replaced(asciiPcd(), "WIDTH 4\nHEIGHT 1\n", ""),
      replaced(asciiPcd(), "WIDTH 4\nHEIGHT 1\n", "WIDTH 2\nHEIGHT 2\n"),
      "VERSION 0.7\n" + bin + binaryRows(),
      "VERSION 0.7\n" + bin + binaryRows() + "surplus",
      "# .PCD v0.7\n# by hand\nVERSION 0.7\n" +
          replaced(bin, "WIDTH", "VIEWPOINT 0 0 0 1 0 0 0\nWIDTH") + binaryRows()};
  for (std::size_t i = 0; i < files.size(); ++i) {
    SCOPED_TRACE("file " + std::to_string(i));
    const std::string path = folder_ + "/cloud.pcd";
    test::writeFile(path, files[i]);
    pcl::PointCloud<pcl::PointXYZ> theirs;
    pcl::PCDReader reader;
    ASSERT_EQ(reader.read(path, theirs), 0);
    RangeCloud ours;
    ASSERT_NO_THROW(ours = loadCloud(path)) << complaint(files[i]);
    ASSERT_EQ(ours.points->size(), theirs.size());
    EXPECT_EQ(ours.points->width, theirs.width);
    for (std::size_t k = 0; k < theirs.size(); ++k) {
      EXPECT_EQ(pcl::isFinite((*ours.points)[k]), pcl::isFinite(theirs[k]));
      if (pcl::isFinite(theirs[k])) {
        EXPECT_EQ((*ours.points)[k].getVector3fMap(), theirs[k].getVector3fMap());
      }
    }
  }
}

TEST_F(CloudDialects, LargeCoordinatesAreShiftedBeforeTheyBecomeFloat)
{
  const Eigen::Vector3d far(451234.25, 5412345.5, 310.125);
  test::Random random(42);
  std::vector<Eigen::Vector3d> points;
  std::string text;
  std::string binary;
  for (int i = 0; i < 50; ++i) {
    points.emplace_back(far + Eigen::Vector3d(random.uniform(-1.0, 1.0),
                                              random.uniform(-1.0, 1.0),
                                              random.uniform(-1.0, 1.0)));
    for (int k = 0; k < 3; ++k) {
      char word[40];
      std::snprintf(word, sizeof(word), "%.12g ", points.back()[k]);
      text += word;
      binary += rawBytes(points.back()[k]);
    }
    text += '\n';
  }
  const std::string size = "WIDTH 50\nVIEWPOINT 451234 5412345 312 1 0 0 0\n";
  const std::string doubles = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n" + size;
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 50\nproperty double x\n"
      "property double y\nproperty double z\nend_header\n";
  for (const std::string& bytes :
       {"VERSION 0.7\n" + doubles + "DATA binary\n" + binary,
        "VERSION 0.7\nFIELDS x y z\n" + size + "DATA ascii\n" + text,
        ply + text}) {
    const Loaded loaded = load(bytes);
    const Eigen::Vector3d offset = loaded.cloud.offset;
    EXPECT_LT((offset - far).norm(), 2.0);
    EXPECT_EQ(offset, offset.array().round().matrix()); // whole metres
    EXPECT_NE(loaded.notices().find("shifted"), std::string::npos);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d q =
          (*loaded.cloud.points)[i].getVector3fMap().cast<double>();
      EXPECT_LT((q + offset - points[i]).norm(), 1e-5) << i; // 12 digits
    }
    if (loaded.info.viewpoint) {
      EXPECT_LT(
          (loaded.cloud.sensor_pose.c + offset - Eigen::Vector3d(451234, 5412345, 312))
              .norm(),
          1e-9);
    }
    // Nothing is lost on the way back to a file.
    for (const bool ascii : {false, true}) {
      saveCloud(folder_ + "/saved.pcd", loaded.cloud, ascii);
      const RangeCloud again = loadCloud(folder_ + "/saved.pcd");
      EXPECT_EQ(again.offset, offset);
      for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_EQ((*again.points)[i].getVector3fMap(),
                  (*loaded.cloud.points)[i].getVector3fMap());
    }
  }
}

TEST_F(CloudDialects, PointsAboutTheOriginAreNotShifted)
{
  test::Random random;
  std::string rows;
  for (int i = 0; i < 200; ++i)
    rows += std::to_string(random.uniform(-1.0, 1.0)) + " " +
            std::to_string(random.uniform(-1.0, 1.0)) + " " +
            std::to_string(random.uniform(0.8, 3.0)) + "\n";
  rows += "3.12 1.65 99.123457\n"; // a stray point
  const auto cloudOf = [&](const std::string& text) {
    std::string pcd = asciiPcd("FIELDS x y z\n" + kSizes, text);
    return replaced(replaced(pcd, "WIDTH 4", "WIDTH 201"), "POINTS 4", "POINTS 201");
  };
  Loaded loaded = load(cloudOf(rows));
  EXPECT_TRUE(loaded.cloud.offset.isZero(0.0));
  EXPECT_EQ(loaded.notices(), "");
  // A room in micrometres likewise: its unit is to be recognised.
  loaded = load(cloudOf(replaced(replaced(rows, ".", ""), " 0", " ")));
  EXPECT_TRUE(loaded.cloud.offset.isZero(0.0));
}

TEST_F(CloudDialects, SinglePrecisionHasLostItsDigitsAlready)
{
  std::string singles;
  for (int i = 0; i < 50; ++i)
    for (const double x : {451234.25 + 0.01 * i, 5412345.5 - 0.02 * i, 310.125})
      singles += rawBytes(static_cast<float>(x));
  const std::string size = "WIDTH 50\nVIEWPOINT 451234 5412345 312 1 0 0 0\n";
  const Loaded coarse =
      load("VERSION 0.7\nFIELDS x y z\n" + size + "DATA binary\n" + singles);
  EXPECT_TRUE(coarse.cloud.offset.isZero());
  EXPECT_NE(coarse.notices().find("only kept to"), std::string::npos);
}

TEST_F(CloudDialects, UnitsScaleEverything)
{
  const std::string fields =
      "FIELDS x y z covariance\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 6\n";
  std::string bytes = "VERSION 0.7\n" + fields + kFour +
                      "VIEWPOINT 10 20 -30 1 0 0 0\nDATA ascii\n" +
                      replaced(kRows, "\n", " 1 0 0 2 0 3\n");
  LoadOptions options;
  options.unit_m = 1e-3;
  const Loaded loaded = load(bytes, options);
  EXPECT_EQ(loaded.info.unit_m, 1e-3);
  EXPECT_LT((loaded.cloud.sensor_pose.c - Eigen::Vector3d(0.01, 0.02, -0.03)).norm(),
            1e-12);
  EXPECT_LT(((*loaded.cloud.points)[1].getVector3fMap() - 1e-3F * kPoints[1]).norm(),
            1e-9F);
  EXPECT_NEAR(loaded.cloud.covariances->front()(1, 1), 2e-6F, 1e-12F);
  EXPECT_LT(((*load(asciiPly(), options).cloud.points)[1].getVector3fMap() -
             1e-3F * kPoints[1])
                .norm(),
            1e-9F);
  options.unit_m = 0.0;
  EXPECT_THROW(load(bytes, options), std::invalid_argument);
}

TEST_F(CloudDialects, AxesTurnTheSensorNotThePoints)
{
  const Pose pose = test::tiltedPose();
  for (const CloudAxes axes : {CloudAxes::Camera, CloudAxes::OpenGl, CloudAxes::Ros}) {
    // The bowl as a sensor with such axes writes it, and the same moved by a pose.
    RangeCloud bowl = test::bowlCloud(8, 6);
    const Eigen::Matrix3d turn = turnFromCamera(axes);
    EXPECT_TRUE((turn * turn.transpose()).isIdentity(1e-15));
    EXPECT_EQ(turn.determinant(), 1.0);
    for (const Pose& stand : {Pose{}, pose}) {
      pcl::PointCloud<pcl::PointXYZ>::Ptr moved(
          new pcl::PointCloud<pcl::PointXYZ>(*bowl.points));
      for (auto& p : *moved)
        p.getVector3fMap() =
            (stand.R * turn * p.getVector3fMap().cast<double>() + stand.c)
                .cast<float>();
      saveCloud(folder_ + "/moved.pcd", {moved, {}, stand});
      LoadOptions options;
      options.axes = axes;
      CloudFileInfo info;
      const RangeCloud loaded = loadCloud(folder_ + "/moved.pcd", options, &info);
      EXPECT_EQ(info.axes, axes);
      const Pose to_camera = loaded.sensor_pose.inverse();
      for (std::size_t i = 1; i < moved->size(); ++i) {
        EXPECT_EQ((*loaded.points)[i].getVector3fMap(), (*moved)[i].getVector3fMap());
        const Eigen::Vector3d q =
            to_camera.toWorld((*moved)[i].getVector3fMap().cast<double>());
        EXPECT_LT((q - (*bowl.points)[i].getVector3fMap().cast<double>()).norm(), 1e-6);
      }
    }
  }
  const auto forward = [](CloudAxes axes) {
    return Eigen::Vector3d(turnFromCamera(axes) * Eigen::Vector3d::UnitZ());
  };
  EXPECT_EQ(forward(CloudAxes::OpenGl), Eigen::Vector3d(0, 0, -1));
  EXPECT_EQ(forward(CloudAxes::Ros), Eigen::Vector3d(1, 0, 0));
}

TEST_F(CloudDialects, TheCallersPoseWins)
{
  const Pose pose = test::tiltedPose();
  saveCloud(folder_ + "/bowl.pcd", test::bowlCloud(8, 6, pose));
  LoadOptions options;
  options.sensor_pose = Pose{Eigen::Matrix3d::Identity(), {1.0, 2.0, 3.0}};
  CloudFileInfo info;
  RangeCloud cloud = loadCloud(folder_ + "/bowl.pcd", options, &info);
  EXPECT_EQ(cloud.sensor_pose.c, options.sensor_pose->c);
  EXPECT_TRUE(cloud.sensor_pose.R.isIdentity());
  ASSERT_TRUE(info.viewpoint.has_value()); // the file's own
  EXPECT_LT((info.viewpoint->c - pose.c).norm(), 1e-9);
  options.viewpoint = Eigen::Vector3d(0.0, 0.0, 5.0);
  EXPECT_THROW(loadCloud(folder_ + "/bowl.pcd", options), std::invalid_argument);
  options.sensor_pose.reset();
  cloud = loadCloud(folder_ + "/bowl.pcd", options);
  EXPECT_EQ(cloud.sensor_pose.c, *options.viewpoint);
  // PCL's default says nothing, and a position alone looks at the points.
  const Loaded plain =
      load(asciiPcd("FIELDS x y z\nVIEWPOINT 0 0 0 1 0 0 0\n"), options);
  EXPECT_FALSE(plain.info.viewpoint.has_value());
  EXPECT_LT(plain.cloud.sensor_pose.R.col(2).z(), -0.9);
}

TEST_F(CloudDialects, ZerosForNoReturnAreInvalid)
{
  const std::string zeros = "0 0 0\n0 0 0\n";
  const auto header = [](int n) {
    return "VERSION 0.7\nFIELDS x y z\nWIDTH " + std::to_string(n) + "\n";
  };
  const Loaded two = load(header(6) + "DATA ascii\n" + kRows + zeros);
  EXPECT_EQ(countValidPoints(two.cloud), 4);
  EXPECT_EQ(two.info.zero_points, 2);
  EXPECT_NE(two.notices().find("2 points at the sensor are taken as invalid"),
            std::string::npos);
  EXPECT_FALSE(two.cloud.points->is_dense);
  const Loaded one = load(header(5) + "DATA ascii\n" + kRows + "-0 0 0\n");
  EXPECT_EQ(countValidPoints(one.cloud), 4);
  // One point there may be a point when the sensor is somewhere else.
  const std::string elsewhere = "VIEWPOINT 0 0 -1 1 0 0 0\nDATA ascii\n";
  EXPECT_EQ(countValidPoints(load(header(5) + elsewhere + kRows + "0 0 0\n").cloud), 5);
  EXPECT_EQ(countValidPoints(load(header(6) + elsewhere + kRows + zeros).cloud), 4);
  EXPECT_NE(complaint(header(2) + "DATA ascii\n" + zeros).find("no valid point"),
            std::string::npos);
  // Zeros are not moved along with large coordinates.
  const std::string far =
      replaced(replaced(kRows, "0.2", "5412345.2"), "0.1", "451234.1");
  const Loaded shifted = load(header(5) + "DATA ascii\n" + far + "0 0 0\n");
  EXPECT_EQ(countValidPoints(shifted.cloud), 4);
  EXPECT_EQ(shifted.info.zero_points, 1);
}

TEST_F(CloudDialects, ZerosThatMovedWithTheCloudAreInvalid)
{
  const std::string header = replaced(asciiPcd("FIELDS x y z\n" + kSizes, ""),
                                      "POINTS 4",
                                      "VIEWPOINT 1.3 -2.1 0.7 1 0 0 0\nPOINTS 4");
  const Loaded loaded =
      load(header + "1.3 -2.1 0.7\n1.3 -2.1 1.7\n1.3 -2.1 0.7\n1.301 -2.1 0.75\n");
  EXPECT_EQ(loaded.info.zero_points, 2);
  EXPECT_EQ(countValidPoints(loaded.cloud), 2);
}

TEST_F(CloudDialects, TooManyPointsAreRefusedByTheHeader)
{
  LoadOptions options;
  options.max_points = 3;
  for (const std::string& bytes :
       {asciiPcd(),
        asciiPly(),
        "VERSION 0.7\nFIELDS x y z\n" + kFour + "DATA binary\n" + binaryRows()})
    EXPECT_NE(complaint(bytes, options).find("announces 4 points"), std::string::npos);
  options.max_points = 4;
  EXPECT_EQ(complaint(asciiPcd(), options), "");
}

}} // namespace holdfast
