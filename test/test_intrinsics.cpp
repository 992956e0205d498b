#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/geometry/rotation.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/intrinsics.h>

#include <cstdlib>
#include <filesystem>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;

constexpr double kPi = 3.14159265358979323846;

double
bumpyDepth(int u, int v)
{
  return 1.0 + 0.2 * std::sin(0.05 * u) + 0.1 * std::cos(0.07 * v);
}

void
expectSameCamera(const Camera& a, const Camera& b, double tolerance_px)
{
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_NEAR(a.fx, b.fx, tolerance_px);
  EXPECT_NEAR(a.fy, b.fy, tolerance_px);
  EXPECT_NEAR(a.cx, b.cx, tolerance_px);
  EXPECT_NEAR(a.cy, b.cy, tolerance_px);
}

Camera
unevenCamera()
{
  Camera camera = makeCamera(320, 240, 260.0);
  camera.fy = 255.0;
  camera.cx = 165.3;
  camera.cy = 112.8;
  return camera;
}

TEST(RecoverIntrinsics, ExactOnExactPixelsFromAnyPose)
{
  for (std::uint64_t c = 0; c < 5; ++c) {
    Random random(c);
    const Camera camera = unevenCamera();
    const Pose pose{random.rotation(), random.uniformVector(-2.0, 2.0)};
    const RangeCloud cloud = makeOrganizedCloud(camera, bumpyDepth, pose);
    double rms_px = -1.0;
    const auto recovered = recoverIntrinsics(cloud, &rms_px);
    ASSERT_TRUE(recovered);
    // Coordinates of about 3 m in single precision: 2.4e-7 m, 1e-4 px.
    expectSameCamera(*recovered, camera, 1e-3);
    EXPECT_LT(rms_px, 1e-3);
    EXPECT_GE(rms_px, 0.0);
  }
}

TEST(RecoverIntrinsics, WithNoiseAndHoles)
{
  Random random;
  const Camera camera = unevenCamera();
  const double sigma_px = 0.35;
  RangeCloud cloud = makeOrganizedCloud(camera, [&](int u, int v) {
    return random.uniform(0.0, 1.0) < 0.7 ? std::nan("") : bumpyDepth(u, v);
  });
  auto noisy = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  for (pcl::PointXYZ& p : *noisy) {
    p.x += static_cast<float>(sigma_px * random.normal() * p.z / camera.fx);
    p.y += static_cast<float>(sigma_px * random.normal() * p.z / camera.fy);
  }
  cloud.points = noisy;
  double rms_px = 0.0;
  const auto recovered = recoverIntrinsics(cloud, &rms_px);
  ASSERT_TRUE(recovered);
  // About 1400 points (every fourth row and column, 30 % valid), pixels spread by 92
  // px: the focal length is sure to 0.35 * 260 / (92 sqrt(1400)) = 0.03 px.
  expectSameCamera(*recovered, camera, 0.2);
  EXPECT_NEAR(rms_px, std::sqrt(2.0) * sigma_px, 0.05);
}

TEST(RecoverIntrinsics, NothingWhereThereIsNoPinholeImage)
{
  const Camera camera = unevenCamera();
  const RangeCloud good = makeOrganizedCloud(camera, bumpyDepth);
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*good.points);
  points->width *= points->height;
  points->height = 1;
  EXPECT_FALSE(recoverIntrinsics({points, {}, {}})) << "unorganized";

  auto mirrored = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*good.points);
  for (pcl::PointXYZ& p : *mirrored)
    p.x = -p.x;
  EXPECT_FALSE(recoverIntrinsics({mirrored, {}, {}})) << "mirrored";

  Random random;
  auto scattered = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*good.points);
  for (pcl::PointXYZ& p : *scattered)
    p.getVector3fMap() = random.uniformVector(0.5, 1.5).cast<float>();
  EXPECT_FALSE(recoverIntrinsics({scattered, {}, {}})) << "no image";

  EXPECT_FALSE(recoverIntrinsics(makeOrganizedCloud(camera, [](int, int v) {
    return v == 20 ? 1.0 : std::nan("");
  }))) << "one row";
  EXPECT_FALSE(recoverIntrinsics(makeOrganizedCloud(camera, [](int, int) {
    return std::nan("");
  }))) << "no point";
}

TEST(RecoverIntrinsics, NothingWhereWidthAndHeightAreExchanged)
{
  // 4:3, 3:2, 16:9: rows that begin alike recur after few of them.
  for (const auto& [width, height] : std::vector<std::pair<int, int>>{{320, 240},
                                                                      {160, 120},
                                                                      {240, 160},
                                                                      {320, 180}}) {
    const Camera camera = makeCamera(width, height, 0.9 * width);
    RangeCloud cloud = makeOrganizedCloud(camera, bumpyDepth);
    ASSERT_TRUE(recoverIntrinsics(cloud));
    const auto exchanged =
        pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
    std::swap(exchanged->width, exchanged->height);
    cloud.points = exchanged;
    EXPECT_FALSE(recoverIntrinsics(cloud)) << width << " x " << height;
  }
}

TEST(CameraTypes, DifferByMoreThanTheirCamerasDo)
{
  const Camera nominal = makeCamera(640, 480, 575.8);
  Camera own = nominal;
  own.fx = 590.0; // 2.5 %
  own.cx += 15.0;
  EXPECT_TRUE(isOfType(own, nominal));
  EXPECT_FALSE(isOfType(makeCamera(640, 480, 525.0), nominal)) << "9 %";
  EXPECT_FALSE(isOfType(makeCamera(320, 240, 575.8), nominal)) << "another size";
  own.cy += 30.0;
  EXPECT_FALSE(isOfType(own, nominal)) << "another window of the image";
}

TEST(MatchedSensor, KeepsACameraThatFits)
{
  const Camera camera = makeCamera(640, 480, 575.8);
  Camera actual = camera;
  actual.fx = actual.fy = 577.0;
  std::string notice;
  const Sensor matched = matchedSensor(makeSensor(camera),
                                       makeOrganizedCloud(actual, bumpyDepth),
                                       &notice);
  EXPECT_TRUE(notice.empty());
  EXPECT_EQ(matched.camera.fx, camera.fx);
}

TEST(MatchedSensor, TakesTheCameraOfTheCloudWithANotice)
{
  const Sensor sensor = makeSensor(makeCamera(640, 480, 575.8));
  const Camera actual = makeCamera(640, 480, 525.0);
  std::string notice;
  const Sensor matched =
      matchedSensor(sensor, makeOrganizedCloud(actual, bumpyDepth), &notice);
  EXPECT_NE(notice.find("525.0"), std::string::npos) << notice;
  EXPECT_EQ(notice.find('\n'), std::string::npos);
  expectSameCamera(matched.camera, actual, 1e-3);
  EXPECT_EQ(matched.noise, sensor.noise);
}

TEST(MatchedSensor, LeavesUnorganizedCloudsAlone)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  points->push_back({0.0F, 0.0F, 1.0F});
  std::string notice;
  const Sensor sensor = makeSensor(makeCamera(640, 480, 575.8));
  EXPECT_EQ(matchedSensor(sensor, {points, {}, {}}, &notice).camera.fx, 575.8);
  EXPECT_TRUE(notice.empty());
}

TEST(ChooseSensorPose, TakesThePoseOfTheFileIfThePointsAgree)
{
  Random random;
  const Pose pose{random.rotation(), random.uniformVector(-2.0, 2.0)};
  const RangeCloud cloud = makeOrganizedCloud(unevenCamera(), bumpyDepth, pose);
  std::string notice;
  EXPECT_EQ(chooseSensorPose(cloud.points, pose, &notice).R, pose.R);
  EXPECT_TRUE(notice.empty());
}

TEST(ChooseSensorPose, IgnoresARotationForDisplay)
{
  const RangeCloud cloud = makeOrganizedCloud(unevenCamera(), bumpyDepth);
  for (const Eigen::Vector3d& r :
       {Eigen::Vector3d(kPi, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, kPi / 2)}) {
    std::string notice;
    const Pose chosen =
        chooseSensorPose(cloud.points, {expMap(r), Eigen::Vector3d::Zero()}, &notice);
    EXPECT_TRUE(chosen.R.isIdentity(0.0));
    EXPECT_FALSE(notice.empty());
  }
}

TEST(ChooseSensorPose, NeverSetsAPositionAside)
{
  Random random;
  const RangeCloud cloud = makeOrganizedCloud(unevenCamera(), bumpyDepth);
  for (int i = 0; i < 20; ++i) {
    const Pose pose{random.rotation(), random.uniformVector(-2.0, 2.0)};
    std::string notice;
    EXPECT_EQ(chooseSensorPose(cloud.points, pose, &notice).c, pose.c);
    EXPECT_TRUE(notice.empty());
  }
}

TEST(ChooseSensorPose, KeepsThePoseOfTheFileWhereNothingFits)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const float z : {-1.0F, 1.0F})
    points->push_back({0.0F, 0.0F, z});
  const Pose pose{expMap({kPi, 0.0, 0.0}), Eigen::Vector3d::Zero()};
  std::string notice;
  EXPECT_EQ(chooseSensorPose(points, pose, &notice).R, pose.R);
  EXPECT_TRUE(notice.empty());
}

// ---- Recorded clouds ----

struct Recording {
  const char* file;
  double fx, fy, cx, cy;
};

class RecordedCloud : public testing::TestWithParam<Recording> {
protected:
  void SetUp() override
  {
    const char* folder = std::getenv("HOLDFAST_DATA_DIR");
    path_ =
        std::filesystem::path(folder ? folder : HOLDFAST_DATA_DIR) / GetParam().file;
    if (!std::filesystem::exists(path_))
      GTEST_SKIP() << "no recorded cloud " << path_;
  }

  std::filesystem::path path_;
};

TEST_P(RecordedCloud, HasItsKnownIntrinsics)
{
  const Recording& known = GetParam();
  const RangeCloud cloud = loadCloud(path_.string());
  double rms_px = 0.0;
  const auto camera = recoverIntrinsics(cloud, &rms_px);
  ASSERT_TRUE(camera);
  // The known values have one decimal.
  EXPECT_NEAR(camera->fx, known.fx, 0.1);
  EXPECT_NEAR(camera->fy, known.fy, 0.1);
  EXPECT_NEAR(camera->cx, known.cx, 0.1);
  EXPECT_NEAR(camera->cy, known.cy, 0.1);
  EXPECT_LT(rms_px, 0.1);
}

INSTANTIATE_TEST_SUITE_P(
    Files,
    RecordedCloud,
    testing::Values(
        Recording{"mosd_static_learn17.pcd", 525.0, 525.0, 319.5, 239.5},
        Recording{"mosd_cyl_learn44.pcd", 525.0, 525.0, 319.5, 239.5},
        Recording{"pcl_milk_clorox_carpet.pcd", 525.0, 525.0, 319.5, 239.5},
        Recording{"pcl_table_mug_stereo.pcd", 964.4, 964.4, 319.8, 223.4},
        Recording{"pcl_grabber_laptop_box.pcd", 525.0, 525.0, 320.0, 240.0}),
    [](const testing::TestParamInfo<Recording>& recording) {
      return std::filesystem::path(recording.param.file).stem().string();
    });

}} // namespace holdfast
