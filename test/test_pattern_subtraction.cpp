#include <holdfast/io/config.h>
#include <holdfast/io/pattern_map_file.h>
#include <holdfast/pcl/pattern_subtraction.h>

#include "support/organized_cloud.h"
#include "support/random.h"
#include "support/run_program.h"

#include <holdfast/sensor/constant_noise_model.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <png.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast { namespace {

constexpr double kFocalTimesBaseline = 580.0 * 0.075; // of makeSensor(), px m

class PatternSubtraction : public testing::Test {
protected:
  PatternSubtraction()
  : sensor_(test::makeSensor(test::makeCamera(40, 30, 50.0)))
  , folder_(test::freshFolder(
        std::string("pattern_subtraction_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  {
    std::vector<float> errors;
    for (int i = 0; i < 40 * 30; ++i)
      errors.push_back(i % 7 == 0 ? test::kNaN :
                                    static_cast<float>(random_.uniform(-0.5, 0.5)));
    sensor_.pattern_map = std::make_shared<const PatternMap>(40, 30, errors);
  }

  /// What the camera measures of a wall 1.5 m away.
  RangeCloud measuredWall(const Pose& pose) const
  {
    return test::makeOrganizedCloud(
        sensor_.camera,
        [this](int u, int v) {
          const auto i = static_cast<std::size_t>(v * 40 + u);
          return kFocalTimesBaseline /
                 (kFocalTimesBaseline / 1.5 + sensor_.pattern_map->error(i));
        },
        pose);
  }

  static void expectWall(const RangeCloud& cloud, const Pose& pose)
  {
    for (const auto& point : *cloud.points)
      EXPECT_NEAR(pose.inverse().toWorld(point.getVector3fMap().cast<double>()).z(),
                  1.5,
                  1e-6);
  }

  test::Random random_;
  Sensor sensor_;
  std::string folder_;
};

TEST_F(PatternSubtraction, LeavesTheWall)
{
  const Pose pose{
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()).matrix(),
      Eigen::Vector3d(0.1, -0.2, 0.3)};
  std::string notice;
  for (const Pose& at : {Pose{}, pose})
    expectWall(subtractPatternMap(measuredWall(at), sensor_, &notice), at);
  EXPECT_EQ(notice, "");
}

TEST_F(PatternSubtraction, FindsThePixelsOfACloudWithoutAGrid)
{
  RangeCloud cloud = measuredWall({});
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (std::size_t i = cloud.points->size(); i-- > 0;)
    points->push_back((*cloud.points)[i]);
  cloud.points = points;
  std::string notice;
  expectWall(subtractPatternMap(cloud, sensor_, &notice), {});
  EXPECT_EQ(notice, "");
}

TEST_F(PatternSubtraction, SaysWhenItDoesNotApply)
{
  RangeCloud cloud = measuredWall({});
  std::string notice;
  cloud.covariances = std::make_shared<const Covariances>(cloud.points->size(),
                                                          Eigen::Matrix3f::Identity());
  EXPECT_EQ(subtractPatternMap(cloud, sensor_, &notice).points, cloud.points);
  EXPECT_NE(notice.find("covariances of its own"), std::string::npos) << notice;

  cloud = measuredWall({});
  auto behind = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const auto& point : *cloud.points)
    behind->push_back({point.x, point.y, -point.z});
  cloud.points = behind;
  EXPECT_EQ(subtractPatternMap(cloud, sensor_, &notice).points, cloud.points);
  EXPECT_NE(notice.find("in no pixel"), std::string::npos) << notice;

  EXPECT_EQ(subtractPatternMap(cloud, withoutPattern(sensor_)).points, cloud.points);
}

TEST_F(PatternSubtraction, RejectsOtherSizesAndNoiseWithoutDisparities)
{
  const RangeCloud small = test::makeOrganizedCloud(test::makeCamera(20, 15, 25.0),
                                                    [](int, int) { return 1.0; });
  EXPECT_THROW(subtractPatternMap(small, sensor_), std::runtime_error);
  EXPECT_EQ(patternMapError(sensor_, 20, 15),
            "20 x 15 pixels, where the pattern map of the sensor test has 40 x 30: "
            "take its own images, or --no-pattern");
  EXPECT_EQ(patternMapError(sensor_, 40, 30), "");
  sensor_.noise = std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{0.001, 0.001});
  EXPECT_THROW(subtractPatternMap(measuredWall({}), sensor_), std::runtime_error);
}

TEST_F(PatternSubtraction, MapsSurviveTheirFiles)
{
  const std::string path = folder_ + "/map.png";
  savePatternMap(path, *sensor_.pattern_map);
  const PatternMap read = loadPatternMap(path);
  ASSERT_EQ(read.width(), 40);
  ASSERT_EQ(read.height(), 30);
  for (std::size_t i = 0; i < read.errors().size(); ++i) {
    const float before = sensor_.pattern_map->errors()[i], after = read.errors()[i];
    EXPECT_EQ(std::isnan(after), std::isnan(before));
    if (!std::isnan(before)) {
      EXPECT_NEAR(after, before, 0.5001 / 1024.0);
    }
  }
  // Beyond what the pixels hold: the largest, never "unknown".
  savePatternMap(path, PatternMap(2, 1, {-50.0F, 50.0F}));
  EXPECT_NEAR(loadPatternMap(path).error(0), -32.0, 0.01);
  EXPECT_NEAR(loadPatternMap(path).error(1), 32.0, 0.01);
}

TEST_F(PatternSubtraction, BadFilesAreNamed)
{
  const auto complaint = [](const std::string& path) -> std::string {
    try {
      loadPatternMap(path);
    }
    catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  const std::string path = folder_ + "/map.png";
  EXPECT_EQ(complaint(path), path + ": no such file");
  EXPECT_EQ(complaint(folder_), folder_ + ": is not a regular file");
  test::writeFile(path, "P5 1 1 65535\n12");
  EXPECT_EQ(complaint(path), path + ": is no PNG, as a pattern map is");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = image.height = 2;
  image.format = PNG_FORMAT_GRAY;
  const std::vector<png_byte> gray(4, 100);
  ASSERT_NE(png_image_write_to_file(&image, path.c_str(), 0, gray.data(), 0, nullptr),
            0);
  EXPECT_NE(complaint(path).find(path + ": PNG: not 16-bit gray"), std::string::npos)
      << complaint(path);
  savePatternMap(path, *sensor_.pattern_map);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_EQ(complaint(path).rfind(path + ": PNG: ", 0), 0U) << complaint(path);
}

TEST_F(PatternSubtraction, SensorFilesNameTheirMap)
{
  const NoiseParameters noise{{"sigma_disparity_px", 0.17},
                              {"sigma_point_px", 0.35},
                              {"baseline_m", 0.075},
                              {"focal_px", 580.0}};
  const std::string file = folder_ + "/mine.yaml";
  EXPECT_THROW(saveSensor(file, sensor_, noise), std::invalid_argument);
  savePatternMap(folder_ + "/map.png", *sensor_.pattern_map);
  saveSensor(file, sensor_, noise, {}, "map.png");
  const Sensor read = loadSensor(file); // the map lies beside it
  ASSERT_NE(read.pattern_map, nullptr);
  EXPECT_NEAR(read.pattern_map->error(1), sensor_.pattern_map->error(1), 1e-3);

  const auto complaint = [&]() -> std::string {
    try {
      loadSensor(file);
    }
    catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  savePatternMap(folder_ + "/map.png", PatternMap(2, 1, {0.0F, 0.0F}));
  EXPECT_NE(complaint().find("map.png: 2 x 1 pixels, where the camera has 40 x 30"),
            std::string::npos)
      << complaint();
  std::filesystem::remove(folder_ + "/map.png");
  EXPECT_NE(complaint().find("map.png: no such file"), std::string::npos)
      << complaint();
  EXPECT_EQ(complaint().rfind(file + ":", 0), 0U) << complaint();
  std::string text = test::readFile(file);
  text.erase(text.find("noise:"));
  test::writeFile(file,
                  text + "noise:\n  model: constant\n  sigma_m: 0.001\n"
                         "  pattern_map: map.png\n");
  EXPECT_NE(complaint().find("noise.pattern_map is of disparities"), std::string::npos)
      << complaint();
}

}} // namespace holdfast
