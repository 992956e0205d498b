/// \file Depth images: what is no measurement, wrong scales and bits, the camera
/// assumed.
#include <holdfast/io/cloud_io.h>

#include "support/random.h"
#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>

#include <functional>

namespace holdfast { namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 48;

/// Depths in units per pixel; 0: none.
using Pixels = std::vector<std::uint16_t>;

/// A slanted, wavy wall with a sensor's noise, 0.9 to 5 m away.
Pixels
wall(double scale, unsigned seed)
{
  test::Random random(seed);
  Pixels pixels;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double z = 1.2 + 0.05 * u + 0.01 * v + 0.05 * std::sin(0.3 * u);
      const double depth = z + 1e-3 * z * z * random.uniform(-1.0, 1.0);
      pixels.push_back(static_cast<std::uint16_t>(u == 5 ? 0.0 : scale * depth));
    }
  return pixels;
}

Pixels
changed(Pixels pixels, const std::function<unsigned(unsigned)>& change)
{
  for (auto& pixel : pixels)
    pixel = static_cast<std::uint16_t>(change(pixel));
  return pixels;
}

std::string
header(const std::string& magic)
{
  return magic + "\n# test\n" + std::to_string(kWidth) + " " + std::to_string(kHeight) +
         "\n65535\n";
}

std::string
binaryPgm(const Pixels& pixels)
{
  std::string bytes = header("P5");
  for (const std::uint16_t pixel : pixels)
    bytes += test::rawBytes(pixel, true);
  return bytes;
}

std::string
textPgm(const Pixels& pixels)
{
  std::string bytes = header("P2");
  for (std::size_t i = 0; i < pixels.size(); ++i)
    bytes += std::to_string(pixels[i]) + (i % 17 == 16 ? "\n" : " ");
  return bytes;
}

/// With the range of a Kinect.
LoadOptions
kinectOptions()
{
  LoadOptions options;
  options.camera_name = "the sensor test";
  options.min_range_m = 0.5;
  options.max_range_m = 8.0;
  return options;
}

class DepthImages : public ::testing::Test {
protected:
  RangeCloud load(const std::string& bytes, const LoadOptions& options)
  {
    const std::string path = folder_ + "/depth.pgm";
    test::writeFile(path, bytes);
    info_ = {};
    RangeCloud cloud = loadCloud(path, options, &info_);
    notices_.clear();
    for (const std::string& notice : info_.notices)
      notices_ += notice + "\n";
    return cloud;
  }

  std::string complaint(const std::string& bytes, const LoadOptions& options)
  {
    try {
      load(bytes, options);
      return {};
    }
    catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
  }

  bool isNoticed(const std::string& words) const
  {
    return notices_.find(words) != std::string::npos;
  }

  std::string folder_ = test::freshFolder(
      std::string("depth_") +
      ::testing::UnitTest::GetInstance()->current_test_info()->name());
  CloudFileInfo info_;
  std::string notices_;
};

TEST_F(DepthImages, TextAndBinaryPgmAreTheSame)
{
  const Pixels pixels = wall(1000.0, 1);
  const RangeCloud binary = load(binaryPgm(pixels), kinectOptions());
  const RangeCloud text = load(textPgm(pixels), kinectOptions());
  ASSERT_EQ(text.points->size(), binary.points->size());
  EXPECT_EQ(text.points->width, static_cast<unsigned>(kWidth));
  EXPECT_EQ(countValidPoints(text), countValidPoints(binary));
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (pixels[i] != 0) {
      EXPECT_EQ((*text.points)[i].getVector3fMap(),
                (*binary.points)[i].getVector3fMap());
    }
  EXPECT_EQ(complaint(textPgm(pixels) + "# end\n", kinectOptions()), "");
  load(textPgm(pixels) + "17\n", kinectOptions());
  EXPECT_TRUE(isNoticed("behind the last pixel")) << notices_;
  load(binaryPgm(pixels) + "rest", kinectOptions());
  EXPECT_TRUE(isNoticed("4 bytes behind the last pixel")) << notices_;
  const std::string whole = textPgm(pixels);
  EXPECT_NE(complaint(whole.substr(0, whole.size() - 10), kinectOptions()), "");
  EXPECT_NE(complaint(header("P2") + "65536 1 2 3", kinectOptions()), "");
  std::string word = whole;
  word.replace(word.size() - 8, 1, "x");
  EXPECT_NE(complaint(word, kinectOptions()), "");
}

TEST_F(DepthImages, PixelsOutOfRangeAreInvalid)
{
  Pixels pixels = wall(1000.0, 2);
  for (std::size_t i = 100; i < 150; ++i)
    pixels[i] = i % 2 == 0 ? 65535 : i % 3 == 0 ? 300 : 9000;
  const auto zeros = std::count(pixels.begin(), pixels.end(), 0);
  const auto expected = static_cast<int>(pixels.size()) - static_cast<int>(zeros) - 50;
  const auto none = std::count(pixels.begin() + 100, pixels.begin() + 150, 0);
  ASSERT_EQ(none, 0);
  const RangeCloud cloud = load(binaryPgm(pixels), kinectOptions());
  EXPECT_EQ(countValidPoints(cloud), expected);
  EXPECT_EQ(info_.out_of_range_pixels, 50);
  EXPECT_TRUE(isNoticed("50 pixels beyond the range of the sensor (0.5 to 8 m)"))
      << notices_;
}

TEST_F(DepthImages, WrongScalesAreNamed)
{
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const double scale : {1000.0, 5000.0, 10000.0}) {
      const std::string bytes = binaryPgm(wall(scale, seed));
      LoadOptions options = kinectOptions();
      options.depth_scale = scale;
      EXPECT_EQ(complaint(bytes, options), "") << scale;
      EXPECT_FALSE(isNoticed("only")) << notices_;
    }
    const std::string tum = binaryPgm(wall(5000.0, seed));
    const std::string words = complaint(tum, kinectOptions());
    EXPECT_NE(words.find("5000"), std::string::npos) << words;
    EXPECT_NE(words.find("--depth-scale"), std::string::npos) << words;
    // Who gives the scale gets what is within the range, and the doubt as a notice.
    LoadOptions options = kinectOptions();
    options.depth_scale_given = true;
    EXPECT_EQ(complaint(tum, options), "");
    EXPECT_TRUE(isNoticed("at 5000")) << notices_;
    options.depth_scale = 1.0;
    EXPECT_NE(complaint(tum, options).find("is the depth scale right"),
              std::string::npos);
  }
}

TEST_F(DepthImages, WrongBitsAreNamed)
{
  const auto swap = [](unsigned p) { return (p << 8U | p >> 8U) & 0xffffU; };
  const auto turn = [](unsigned p) { return (p << 3U | p >> 13U) & 0xffffU; };
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Pixels good = wall(1000.0, seed);
    for (const auto& write : {binaryPgm, textPgm}) {
      EXPECT_EQ(complaint(write(good), kinectOptions()), "");
      const std::string swapped =
          complaint(write(changed(good, swap)), kinectOptions());
      EXPECT_NE(swapped.find("byte-swapped"), std::string::npos) << swapped;
      const std::string turned = complaint(write(changed(good, turn)), kinectOptions());
      EXPECT_NE(turned.find("rotated by three"), std::string::npos) << turned;
    }
    // Beyond 8.192 m the bits wrap around.
    const Pixels far =
        changed(good, [](unsigned p) { return p == 0 ? 0U : p + 6000U; });
    const std::string wrapped =
        complaint(binaryPgm(changed(far, turn)), kinectOptions());
    EXPECT_NE(wrapped.find("rotated by 3 bits"), std::string::npos) << wrapped;
    // Nothing is known about the sensor's range.
    EXPECT_NE(complaint(binaryPgm(changed(good, swap)), {}), "");
    EXPECT_EQ(complaint(binaryPgm(good), {}), "");
  }
}

TEST_F(DepthImages, TheCameraIsSaid)
{
  const std::string bytes = binaryPgm(wall(1000.0, 3));
  LoadOptions options = kinectOptions();
  load(bytes, options);
  ASSERT_TRUE(info_.camera.has_value());
  EXPECT_NEAR(info_.camera->fx,
              options.camera.fx * kWidth / options.camera.width,
              1e-9);
  EXPECT_TRUE(isNoticed("camera assumed: fx 57.6")) << notices_;
  EXPECT_TRUE(isNoticed("from the sensor test"));
  EXPECT_TRUE(isNoticed("a smaller image of the same view was assumed")) << notices_;
  EXPECT_TRUE(isNoticed("--intrinsics"));
  options.camera_given = true;
  options.camera.fx = 60.0;
  options.camera.cx = 30.0;
  const RangeCloud cloud = load(bytes, options);
  EXPECT_EQ(info_.camera->fx, 60.0);
  EXPECT_EQ(info_.camera->width, kWidth);
  EXPECT_FALSE(isNoticed("assumed")) << notices_;
  const pcl::PointXYZ& p = (*cloud.points)(50, 7);
  EXPECT_NEAR(60.0F * p.x / p.z + 30.0F, 50.0F, 1e-4F);
}

TEST_F(DepthImages, AnImageOfAnotherShapeNeedsIntrinsics)
{
  LoadOptions options = kinectOptions();
  options.camera.width = 100;
  EXPECT_NE(complaint(binaryPgm(wall(1000.0, 4)), options).find("--intrinsics"),
            std::string::npos);
}

TEST_F(DepthImages, BombsAreRefusedByTheirHeader)
{
  // 60000 x 60000 pixels: what an image of 7 MB could unpack to.
  const std::string size = test::rawBytes(std::uint32_t{60000}, true);
  const std::string bytes =
      "\x89PNG\r\n\x1a\n" +
      test::pngChunk("IHDR", size + size + std::string("\x10\0\0\0\0", 5)) +
      test::pngChunk("IDAT", std::string(7100000, 'x'));
  EXPECT_NE(complaint(bytes, kinectOptions()).find("announces 3600000000 points"),
            std::string::npos)
      << complaint(bytes, kinectOptions());
  LoadOptions options = kinectOptions();
  options.max_points = 100;
  EXPECT_NE(
      complaint(binaryPgm(wall(1000.0, 1)), options).find("announces 3072 points"),
      std::string::npos);
}

TEST_F(DepthImages, RecordedImageOfTum)
{
  const std::string path = test::recordedCloud("tum_fr2desk_depth.png");
  if (path.empty())
    GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
  LoadOptions options = kinectOptions();
  EXPECT_THROW(loadCloud(path, options), std::runtime_error);
  options.depth_scale = 5000.0;
  EXPECT_NO_THROW(loadCloud(path, options));
}

}} // namespace holdfast
