// `holdfast render`: pictures of results and of the types, read back pixel by pixel.
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/patch_io.h>

#include "support/result_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <png.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;
using Rgb = std::array<std::uint8_t, 3>;

constexpr Rgb kWhite{255, 255, 255};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Rgb> pixels;

  int count(const Rgb& color) const
  {
    return static_cast<int>(std::count(pixels.begin(), pixels.end(), color));
  }

  int countOther(const Rgb& color) const
  {
    return static_cast<int>(pixels.size()) - count(color);
  }
};

Picture
readPicture(const std::string& path)
{
  const std::string bytes = test::readFile(path);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  Picture picture;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    ADD_FAILURE() << path << ": " << image.message;
    return picture;
  }
  EXPECT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_RGB));
  picture.width = static_cast<int>(image.width);
  picture.height = static_cast<int>(image.height);
  picture.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr),
            0);
  return picture;
}

class RenderProgram : public test::ResultProgram {
protected:
  RenderProgram() : ResultProgram("render", "picture.png") {}

  /// Fits the sample cloud. \return the result file.
  std::string fitRocks() const
  {
    const test::ProgramRun run =
        test::runProgram(folder_,
                         {"fit",
                          HOLDFAST_SOURCE_DIR "/samples/rocks.pcd",
                          "-o",
                          folder_,
                          "--spacing",
                          "0.1",
                          "--quiet"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return folder_ + "/rocks.patches.json";
  }

  Picture render(Names arguments) const
  {
    arguments.insert(arguments.end(), {"-o", output_});
    EXPECT_EQ(runWell(arguments), "");
    return readPicture(output_);
  }
};

/// Whether some pixel is within 8 of a colour: the colour bar's ends stand for a whole
/// step of it, and its polynomials are good to 3 % or so.
bool
hasNearly(const Picture& picture, const Rgb& color)
{
  for (const Rgb& pixel : picture.pixels) {
    bool is_near = true;
    for (std::size_t i = 0; i < color.size(); ++i)
      is_near = is_near && std::abs(pixel[i] - color[i]) <= 8;
    if (is_near)
      return true;
  }
  return false;
}

TEST_F(RenderProgram, ShowsCloudPatchesAndALegendOfTheirTypes)
{
  const std::string result = fitRocks();
  const Picture picture = render({result});
  EXPECT_EQ(picture.width, 960);
  EXPECT_EQ(picture.height, 720);
  // The cloud has the aspect ratio of the picture and fills most of it.
  EXPECT_GT(picture.countOther(kWhite), 960 * 720 / 2);
  std::set<SurfaceType> types;
  for (const ExtractedPatch& patch : readJson(test::readFile(result)).result.patches)
    types.insert(patch.fit.patch.type.surface);
  ASSERT_GT(types.size(), 2U);
  // A swatch is 14 x 14 px.
  for (const SurfaceType type : types)
    EXPECT_GE(picture.count(surfaceColor(type)), 14 * 14) << surfaceName(type);
  EXPECT_LT(picture.count(surfaceColor(SurfaceType::Sphere)), 14);
}

TEST_F(RenderProgram, ColorsByAMeasureWithABar)
{
  const std::string result = fitRocks();
  std::set<std::vector<Rgb>> pictures;
  for (const std::string measure : {"sigma-normal", "sigma-centre", "chi2"}) {
    SCOPED_TRACE(measure);
    const Picture picture = render({result, "--color", measure, "--size", "400x300"});
    // The published ends and middle of viridis.
    EXPECT_TRUE(hasNearly(picture, {68, 1, 84}));
    EXPECT_TRUE(hasNearly(picture, {33, 145, 140}));
    EXPECT_TRUE(hasNearly(picture, {253, 231, 37}));
    pictures.insert(picture.pixels);
  }
  EXPECT_EQ(pictures.size(), 3U);
}

TEST_F(RenderProgram, SameInputSamePicture)
{
  const std::string result = fitBowl("bowl");
  const Names arguments{result, "--size", "300x240"};
  EXPECT_EQ(render(arguments).pixels, render(arguments).pixels);
}

TEST_F(RenderProgram, OptionsChangeThePicture)
{
  const std::string result = fitBowl("bowl");
  std::set<std::vector<Rgb>> pictures;
  const std::vector<Names> variants{{},
                                    {"--view", "iso"},
                                    {"--view", "0,90"},
                                    {"--view=-120,-20"},
                                    {"--zoom", "2"},
                                    {"--max-patches", "3"},
                                    {"--background", "black"}};
  for (Names arguments : variants) {
    arguments.insert(arguments.end(), {result, "--size", "300x240"});
    const Picture picture = render(arguments);
    EXPECT_EQ(picture.width, 300);
    EXPECT_EQ(picture.height, 240);
    pictures.insert(picture.pixels);
  }
  EXPECT_EQ(pictures.size(), variants.size());
}

TEST_F(RenderProgram, BackgroundIsAsAskedFor)
{
  const std::string result = fitBowl("bowl");
  const Picture picture = render({result, "--background", "#102030"});
  EXPECT_EQ(picture.pixels.front(), (Rgb{0x10, 0x20, 0x30}));
  EXPECT_EQ(picture.count(kWhite), 0);
  // Words are light on dark.
  EXPECT_GT(picture.count({225, 225, 225}), 20);
}

TEST_F(RenderProgram, PointsKeepTheColorsOfTheFile)
{
  const std::string result = fitBowl("bowl");
  const RangeCloud cloud = loadCloud(folder_ + "/bowl.pcd");
  std::string pcd =
      test::pcdHeader("FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n",
                      40,
                      30,
                      "ascii");
  const Pose to_camera = cloud.sensor_pose.inverse();
  for (const auto& point : *cloud.points) {
    const Eigen::Vector3d q = to_camera.toWorld(point.getVector3fMap().cast<double>());
    const std::string xyz = q.allFinite() ?
                                std::to_string(q.x()) + ' ' + std::to_string(q.y()) +
                                    ' ' + std::to_string(q.z()) :
                                "nan nan nan";
    pcd += xyz + ' ' + std::to_string(0xff00ff) + '\n';
  }
  test::writeFile(folder_ + "/magenta.pcd", pcd);
  const Picture picture =
      render({result, "--cloud", folder_ + "/magenta.pcd", "--max-patches", "1"});
  // The discs of 1199 points that far apart have the largest radius, 5 px; one patch
  // covers some of them.
  EXPECT_GT(picture.count({255, 0, 255}), 1199 * 78 / 2);
}

// Glass would cover a hole in the cloud; its pixels are those of the background.
TEST_F(RenderProgram, WhatNoPointsSupportIsLeftOut)
{
  RangeCloud cloud = test::bowlCloud(40, 30);
  saveCloud(folder_ + "/bowl.pcd", cloud);
  const test::ProgramRun run = test::runProgram(
      folder_,
      {"fit", folder_ + "/bowl.pcd", "--whole", "--accept", "all", "-o", folder_});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  auto holed = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  for (int v = 8; v < 22; ++v)
    for (int u = 12; u < 28; ++u)
      (*holed)(u, v).x = (*holed)(u, v).y = (*holed)(u, v).z =
          std::numeric_limits<float>::quiet_NaN();
  cloud.points = holed;
  saveCloud(folder_ + "/holed.pcd", cloud);
  const auto drawn = [&](const std::string& name) {
    return render({folder_ + "/bowl.patches.json", "--cloud", folder_ + "/" + name})
        .countOther(kWhite);
  };
  // The hole is a fifth of the cloud; cells at its rim have points.
  EXPECT_LT(drawn("holed.pcd"), 0.9 * drawn("bowl.pcd"));
}

TEST_F(RenderProgram, SeveralResultsGiveASheet)
{
  const Picture sheet =
      render({fitBowl("a"), fitBowl("b"), fitBowl("c"), "--size", "800x600"});
  // Three of four quarters are taken: between bowls the last stays empty but for the
  // legend at the foot.
  const auto drawn = [&](int left, int top) {
    int other = 0;
    for (int v = top; v < top + 200; ++v)
      for (int u = left; u < left + 400; ++u)
        other += sheet.pixels[static_cast<std::size_t>(v * 800 + u)] != kWhite;
    return other;
  };
  EXPECT_GT(drawn(0, 30), 20000);
  EXPECT_GT(drawn(400, 30), 20000);
  EXPECT_GT(drawn(0, 330), 20000);
  EXPECT_EQ(drawn(400, 330), 0);
}

TEST_F(RenderProgram, TypesAreAllThere)
{
  const Picture picture = render({"--types", "--size", "900x420"});
  EXPECT_GT(picture.countOther(kWhite), 900 * 420 / 5);
  EXPECT_EQ(picture.pixels.front(), kWhite);
}

TEST_F(RenderProgram, ScansFromAllSidesAreSeenFromAside)
{
  const std::string result = fitBowl("bowl");
  // The same points with the sensor in their middle.
  RangeCloud cloud = loadCloud(folder_ + "/bowl.pcd");
  pcl::PointCloud<pcl::PointXYZ>::Ptr around(
      new pcl::PointCloud<pcl::PointXYZ>(*cloud.points));
  for (auto& point : *around)
    point.getVector3fMap() -= (*cloud.points)(20, 15).getVector3fMap();
  cloud.points = around;
  cloud.sensor_pose = {};
  saveCloud(folder_ + "/around.pcd", cloud);
  const test::ProgramRun run = test::runProgram(
      folder_,
      {"render", result, "--cloud", folder_ + "/around.pcd", "-o", output_});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("note: "), std::string::npos);
  EXPECT_NE(run.err.find("not seen from a sensor"), std::string::npos);
  EXPECT_GT(readPicture(output_).countOther(kWhite), 1000);
}

/// A bowl in millimetres and axes of OpenGL, and one as a depth image in units of
/// 0.2 mm by a camera of its own: what a file does not say, and options do.
struct OddFile {
  std::string name;
  std::string bytes;
  Names options; ///< that it must be read with
};

std::vector<OddFile>
oddFiles()
{
  const RangeCloud bowl = test::bowlCloud(120, 90);
  RangeCloud turned = bowl;
  const auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*bowl.points);
  turned.points = points;
  const Eigen::Matrix3f turn =
      1000.0F * turnFromCamera(CloudAxes::OpenGl).cast<float>();
  for (pcl::PointXYZ& point : *points)
    point.getVector3fMap() = turn * point.getVector3fMap();
  const Camera camera = test::smallCamera(120, 90);
  std::string intrinsics;
  for (const double number : {camera.fx, camera.fy, camera.cx, camera.cy})
    intrinsics += (intrinsics.empty() ? "" : ",") + std::to_string(number);
  return {
      {"bowl.pcd", test::compressedPcd(turned), {"--unit", "mm", "--axes", "opengl"}},
      {"bowl.pgm",
       test::pgmBytes(bowl, 5000.0),
       {"--depth-scale", "5000", "--intrinsics", intrinsics}}};
}

TEST_F(RenderProgram, CloudsAreReadAsForTheirResult)
{
  for (const OddFile& file : oddFiles()) {
    SCOPED_TRACE(file.name);
    const std::string cloud = folder_ + "/" + file.name;
    test::writeFile(cloud, file.bytes);
    Names fit{"fit", cloud, "-o", folder_, "--quiet"};
    fit.insert(fit.end(), file.options.begin(), file.options.end());
    const test::ProgramRun fitted = test::runProgram(folder_, fit);
    ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
    Names fits{folder_ + "/bowl.patches.json", "--size", "300x240"};
    const Picture picture = render(fits);
    fits.insert(fits.end(), file.options.begin(), file.options.end());
    EXPECT_EQ(picture.pixels, render(fits).pixels);

    Names risk{"risk", cloud, "--foot", "point_foot", "--quiet"};
    risk.insert(risk.end(), file.options.begin(), file.options.end());
    risk.insert(risk.end(), {"-o", folder_ + "/risk.json"});
    const test::ProgramRun ranked = test::runProgram(folder_, risk);
    ASSERT_EQ(ranked.exit_code, 0) << ranked.err;
    Names risks{folder_ + "/risk.json", "--color", "risk", "--size", "300x240"};
    const Picture of_risk = render(risks);
    risks.insert(risks.end(), file.options.begin(), file.options.end());
    EXPECT_EQ(of_risk.pixels, render(risks).pixels);
    // What is said is as it is said.
    fits.insert(fits.end(), {"--viewpoint", "0.02", "0", "0"});
    EXPECT_NE(picture.pixels, render(fits).pixels);
  }
}

TEST_F(RenderProgram, BadResultsAreNamed)
{
  const std::string result = fitBowl("bowl");
  const std::string text = test::readFile(result);
  const auto write = [&](const std::string& name, const std::string& bytes) {
    test::writeFile(folder_ + "/" + name, bytes);
    return folder_ + "/" + name;
  };
  Json nothing = Json::parse(text), impossible = nothing;
  nothing["patches"] = Json::array();
  impossible["patches"][0]["parameters"][0] = -1.0;
  expectError(1, {folder_ + "/missing.json"}, "missing.json: cannot be read");
  expectError(1, {folder_}, ": is a directory");
  expectError(1, {write("empty.json", "")}, "empty.json: no result");
  expectError(1, {write("cut.json", text.substr(0, 700))}, "cut.json: no result");
  expectError(1, {write("other.json", "{}")}, "other.json: no result");
  expectError(1, {write("none.json", nothing.dump())}, "none.json: has no patch");
  expectError(1,
              {write("bad.json", impossible.dump())},
              "bad.json: has an impossible patch");
  expectError(1, {result, "--cloud", result}, "bowl.patches.json: is neither PCD");
  expectError(1, {result, "--cloud", folder_ + "/no.pcd"}, "no.pcd: no such file");
  std::filesystem::remove(folder_ + "/bowl.pcd");
  expectError(1, {result}, "its cloud bowl.pcd is neither here");
}

TEST_F(RenderProgram, NonsenseOptionsAreRefused)
{
  const std::string result = fitBowl("bowl");
  expectError(2, {}, "RESULT");
  expectError(2, {result, "--types"}, "does not go with --types");
  expectError(2, {"--types", "--color", "chi2"}, "--types excludes --color");
  expectError(2, {result, result, "--cloud", folder_ + "/bowl.pcd"}, "single RESULT");
  expectError(2, {result, "--color", "blue"}, "'blue' is none of type, sigma-normal");
  for (const std::string size : {"0x0", "960", "960x", "x720", "99999x720", "-9x9"})
    expectError(2, {result, "--size=" + size}, "'" + size + "' is not WIDTHxHEIGHT");
  for (const std::string view : {"above", "1", "1,", "0,91", "nan,0"})
    expectError(2, {result, "--view", view}, "'" + view + "' is neither camera");
  for (const std::string background : {"pink", "#12345", "#12345g", "123456"})
    expectError(2, {result, "--background", background}, "is neither white nor black");
  expectError(2, {result, "--zoom", "0"}, "--zoom");
  expectError(2, {result, "--max-patches", "0"}, "--max-patches");
  expectError(2, {result, "--sensor", "nonsense"}, "--sensor");
  Names many(100, result);
  many.insert(many.end(), {"--size", "300x300"});
  expectError(2, many, "--size: is too small");
}

TEST_F(RenderProgram, UnwritableOutput)
{
  const std::string result = fitBowl("bowl");
  for (const auto& [path, code] :
       {std::pair<std::string, int>{folder_ + "/no/picture.png", 1},
        {folder_ + "/picture.jpg", 2}}) {
    const test::ProgramRun run =
        test::runProgram(folder_, {"render", result, "-o", path});
    EXPECT_EQ(run.exit_code, code);
    EXPECT_EQ(run.errorLines(), 1) << run.err;
    EXPECT_NE(run.err.find(path), std::string::npos) << run.err;
  }
}

TEST_F(RenderProgram, HelpTeaches)
{
  const test::ProgramRun run = test::runProgram(folder_, {"render", "--help"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.out.find("Examples:"), std::string::npos);
}

}} // namespace holdfast
