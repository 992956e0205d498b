#include "support/organized_cloud.h"
#include "support/random.h"

#include "core/frame_queue.h"
#include "core/message_clouds.h"
#include "core/session.h"

#include <holdfast/geometry/rotation.h>
#include <holdfast/pcl/patch_extraction.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace holdfast::robot { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;
using test::Random;

/// A quarter of a Kinect's in each direction.
const Camera kCamera = makeCamera(160, 120, 143.95);

Frame
wallFrame(Random& random, Stamp stamp, const std::string& frame_id = "camera")
{
  Frame frame;
  frame.header = {stamp, frame_id};
  frame.cloud = makeOrganizedCloud(kCamera, [&random](int, int) {
    return 1.0 + 0.003 * random.normal();
  });
  return frame;
}

/// Knows the poses it was given, whatever the time.
struct FakeTransforms {
  std::optional<Pose> pose;

  std::optional<Pose> operator()(const std::string& /*target*/,
                                 const std::string& /*source*/,
                                 Stamp /*stamp*/,
                                 std::string& cause) const
  {
    cause = "nobody tells";
    return pose;
  }
};

Tuning
fewPatches()
{
  Tuning tuning;
  tuning.max_patches = 20;
  tuning.budget_ms = 0.0; // no clock in a test
  return tuning;
}

TEST(FrameQueue, ANewerFrameTakesThePlaceOfTheOldestAndIsCounted)
{
  FrameQueue<int> queue(2);
  for (int i = 1; i <= 5; ++i)
    queue.put(i);
  EXPECT_EQ(queue.take(), 4);
  EXPECT_EQ(queue.take(), 5);
  EXPECT_EQ(queue.received(), 5U);
  EXPECT_EQ(queue.dropped(), 3U);
}

TEST(FrameQueue, EndsTheWaitOfWhoTakesWhenItIsClosed)
{
  FrameQueue<int> queue(1);
  std::thread taker([&queue] { EXPECT_FALSE(queue.take()); });
  queue.close();
  taker.join();
  queue.put(1);
  EXPECT_FALSE(queue.take());
}

TEST(TroubleThrottle, SaysEachKindOnceInAPeriodAndHowOftenItWasNotSaid)
{
  using std::chrono::seconds;
  TroubleThrottle throttle{seconds(10)};
  const TroubleThrottle::Clock::time_point start{};
  EXPECT_EQ(throttle.pass(Trouble::NoValidPoint, "none", start), "none");
  EXPECT_EQ(throttle.pass(Trouble::TimeJump, "jump", start), "jump");
  EXPECT_FALSE(throttle.pass(Trouble::NoValidPoint, "none", start + seconds(1)));
  EXPECT_FALSE(throttle.pass(Trouble::NoValidPoint, "none", start + seconds(9)));
  const auto again = throttle.pass(Trouble::NoValidPoint, "none", start + seconds(11));
  ASSERT_TRUE(again);
  EXPECT_NE(again->find("2 more"), std::string::npos) << *again;
}

template <typename Number>
std::vector<std::uint8_t>
bytesOf(const std::vector<Number>& numbers, bool is_swapped = false)
{
  std::vector<std::uint8_t> bytes(numbers.size() * sizeof(Number));
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  if (is_swapped)
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(Number))
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                   bytes.begin() + static_cast<std::ptrdiff_t>(i + sizeof(Number)));
  return bytes;
}

/// Two rows of two points x y z and a number that nobody wants, with room behind rows.
PointLayout
fourPoints()
{
  PointLayout layout;
  layout.width = layout.height = 2;
  layout.point_step = 16;
  layout.row_step = 40;
  layout.x = 0;
  layout.y = 4;
  layout.z = 8;
  return layout;
}

TEST(MessageClouds, PointsAreReadWhateverTheStepsAndTheOrderOfBytes)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> numbers{1, 2, 3, -1, 0,   0, 0, -1, 9, 9,
                                   4, 5, 6, -1, nan, 1, 1, -1, 9, 9};
  // Of the host, which is little-endian wherever PCL's files are read.
  for (const bool is_bigendian : {false, true}) {
    PointLayout layout = fourPoints();
    layout.is_bigendian = is_bigendian;
    const auto bytes = bytesOf(numbers, is_bigendian);
    const RangeCloud cloud = readPoints(layout, bytes.data(), bytes.size());
    ASSERT_EQ(cloud.points->width, 2U);
    ASSERT_EQ(cloud.points->height, 2U);
    EXPECT_EQ((*cloud.points)(0, 0).getVector3fMap(), Eigen::Vector3f(1, 2, 3));
    EXPECT_EQ((*cloud.points)(0, 1).getVector3fMap(), Eigen::Vector3f(4, 5, 6));
    EXPECT_TRUE(std::isnan((*cloud.points)(1, 0).x)) << "0 0 0 is no point";
    EXPECT_TRUE(std::isnan((*cloud.points)(1, 1).y)) << "half a point is none";
  }
}

TEST(MessageClouds, LayoutsThatLieAreErrorsAndNothingIsReadOutside)
{
  const std::vector<std::uint8_t> bytes(80);
  const auto read = [&bytes](const PointLayout& layout) {
    return readPoints(layout, bytes.data(), bytes.size());
  };
  EXPECT_NO_THROW(read(fourPoints()));
  for (const auto& spoil : std::vector<void (*)(PointLayout&)>{
           [](PointLayout& l) { l.height = 3; },
           [](PointLayout& l) { l.width = 3; },
           [](PointLayout& l) { l.point_step = 0; },
           [](PointLayout& l) { l.row_step = 0; },
           [](PointLayout& l) { l.z = 13; },
           [](PointLayout& l) { l.height = std::numeric_limits<std::size_t>::max(); },
           [](PointLayout& l) { l.row_step = std::numeric_limits<std::size_t>::max(); },
           [](PointLayout& l) { l.width = l.row_step = l.height = 1U << 31U; }}) {
    PointLayout layout = fourPoints();
    spoil(layout);
    EXPECT_THROW(read(layout), std::runtime_error);
  }
}

TEST(MessageClouds, DepthsInMillimetresAndMetresAreTheSamePoints)
{
  Sensor sensor = test::makeSensor(makeCamera(2, 1, 10.0));
  sensor.min_range_m = 0.5;
  sensor.max_range_m = 4.0;
  DepthLayout layout;
  layout.width = 2;
  layout.height = 1;
  layout.row_step = 4;
  layout.encoding = "16UC1";
  const auto millimetres = bytesOf(std::vector<std::uint16_t>{1500, 5000});
  const RangeCloud a =
      readDepth(layout, millimetres.data(), millimetres.size(), sensor);
  layout.row_step = 8;
  layout.encoding = "32FC1";
  const auto metres = bytesOf(std::vector<float>{1.5F, 5.0F});
  const RangeCloud b = readDepth(layout, metres.data(), metres.size(), sensor);
  for (const RangeCloud& cloud : {a, b}) {
    EXPECT_TRUE((*cloud.points)[0].getVector3fMap().isApprox(
        sensor.camera.backProject(0, 0, 1.5).cast<float>()));
    EXPECT_TRUE(std::isnan((*cloud.points)[1].z)) << "beyond the range";
  }
  layout.encoding = "rgb8";
  EXPECT_THROW(readDepth(layout, metres.data(), metres.size(), sensor),
               std::runtime_error);
}

TEST(MotionCovariance, IsThatOfMotionsWithSuchVelocities)
{
  Random random;
  const auto vector = [&random](double scale) -> Eigen::Vector3d {
    return scale * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  };
  const Pose sensor{expMap(vector(1.0)), vector(0.5)};
  const Pose motion{expMap(vector(0.2)), vector(0.1)};
  const double seconds = 0.2;
  const Pose body = sensor * motion * sensor.inverse();
  // Small enough that the second order is a thousandth of the first.
  const double sigma = 1e-3;
  JetMatrix sum = JetMatrix::Zero();
  const int draws = 20000;
  for (int i = 0; i < draws; ++i) {
    const Pose off{body.R * expMap(seconds * vector(sigma)),
                   body.c + seconds * vector(sigma)};
    const Pose moved = sensor.inverse() * off * sensor;
    JetVector error;
    error << logMap(motion.R.transpose() * moved.R), moved.c - motion.c;
    sum += error * error.transpose();
  }
  const JetMatrix expected =
      motionCovariance(sigma * sigma * JetMatrix::Identity(), seconds, motion, sensor);
  // The scatter of an entry is 1/sqrt(draws) of the product of its sigmas, times up to
  // sqrt(2); five of that for 36 entries.
  const JetVector s = expected.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(sum(i, j) / draws / (s[i] * s[j]),
                  expected(i, j) / (s[i] * s[j]),
                  5.0 * std::sqrt(2.0 / draws));
}

TEST(Session, AnswersWithThePatchesOfTheLibrary)
{
  Random random;
  Settings settings;
  Tuning whole;
  whole.max_patches = 0;
  whole.budget_ms = 0.0;
  Session session(settings, whole, FakeTransforms{});
  const Frame frame = wallFrame(random, 1);
  const Answer answer = session.answer(frame);
  EXPECT_TRUE(answer.complaints.empty());
  EXPECT_EQ(answer.header.frame_id, "camera");
  ExtractionOptions options;
  options.validation->max_view_angle_rad =
      whole.max_view_angle_deg * std::acos(-1.0) / 180.0;
  const ExtractionResult expected =
      extractPatches(frame.cloud, withCamera(session.sensor(), kCamera), options);
  ASSERT_EQ(answer.patches.size(), expected.patches.size());
  for (std::size_t i = 0; i < expected.patches.size(); ++i)
    EXPECT_TRUE(answer.patches[i].patch.fit.state_covariance.isApprox(
        expected.patches[i].fit.state_covariance,
        1e-3)); // recovered camera
}

TEST(Session, SaysWhatIsWrongWithAFrameAndGoesOn)
{
  Random random;
  Settings settings;
  Session session(settings, fewPatches(), FakeTransforms{});
  const auto troubleOf = [&](const Frame& frame) {
    const Answer answer = session.answer(frame);
    EXPECT_TRUE(answer.patches.empty());
    EXPECT_EQ(answer.complaints.size(), 1U);
    return answer.complaints.at(0).trouble;
  };
  Frame unreadable = wallFrame(random, 1);
  unreadable.unreadable = "cut off";
  EXPECT_EQ(troubleOf(unreadable), Trouble::Unreadable);
  Frame empty = wallFrame(random, 2);
  empty.cloud = makeOrganizedCloud(kCamera, [](int, int) { return std::nan(""); });
  EXPECT_EQ(troubleOf(empty), Trouble::NoValidPoint);
  Frame behind = wallFrame(random, 3);
  behind.cloud = makeOrganizedCloud(
      kCamera,
      [](int, int) { return 1.0; },
      Pose{expMap({3.0, 0.0, 0.0}), Eigen::Vector3d::Zero()});
  EXPECT_EQ(troubleOf(behind), Trouble::WrongFrame);
  EXPECT_FALSE(session.answer(wallFrame(random, 4)).patches.empty());
}

TEST(Session, WantsATransformWhereTheSensorHasAFrameOfItsOwn)
{
  Random random;
  Settings settings;
  settings.sensor_frame = "camera";
  Session lost(settings, fewPatches(), FakeTransforms{});
  const Answer answer = lost.answer(wallFrame(random, 1, "base"));
  ASSERT_EQ(answer.complaints.size(), 1U);
  EXPECT_EQ(answer.complaints[0].trouble, Trouble::MissingTransform);
  EXPECT_NE(answer.complaints[0].text.find("nobody tells"), std::string::npos);
  const Answer nameless = lost.answer(wallFrame(random, 2, ""));
  ASSERT_EQ(nameless.complaints.size(), 1U);
  EXPECT_EQ(nameless.complaints[0].trouble, Trouble::WrongFrame);
  Session found(settings, fewPatches(), FakeTransforms{Pose()});
  EXPECT_FALSE(found.answer(wallFrame(random, 1, "base")).patches.empty());
}

TEST(Session, AMapStartsAnewWhenTimeJumpsAndOutlivesFramesThatAreNone)
{
  Random random;
  Settings settings;
  settings.map = true;
  settings.odometry_frame = "odom";
  Session session(settings, fewPatches(), FakeTransforms{Pose()});
  constexpr Stamp kSecond = 1000000000;
  const auto at = [&](Stamp stamp) { return session.answer(wallFrame(random, stamp)); };
  const Answer first = at(100 * kSecond);
  ASSERT_FALSE(first.patches.empty());
  EXPECT_TRUE(first.is_map);
  EXPECT_EQ(first.header.frame_id, "odom");
  const std::uint64_t id = first.patches[0].id;
  const auto knows = [id](const Answer& answer) {
    return std::any_of(answer.patches.begin(),
                       answer.patches.end(),
                       [id](const AnswerPatch& patch) { return patch.id == id; });
  };
  Frame behind = wallFrame(random, 101 * kSecond);
  behind.cloud = makeOrganizedCloud(
      kCamera,
      [](int, int) { return 1.0; },
      Pose{expMap({3.0, 0.0, 0.0}), Eigen::Vector3d::Zero()});
  EXPECT_TRUE(session.answer(behind).patches.empty());
  EXPECT_TRUE(knows(at(102 * kSecond)));
  const Answer late = at(102 * kSecond - 1);
  EXPECT_TRUE(late.patches.empty()) << "a late frame is left out";
  EXPECT_FALSE(late.time_jumped);
  const Answer jumped = at(50 * kSecond);
  EXPECT_TRUE(jumped.time_jumped);
  ASSERT_FALSE(jumped.patches.empty());
  for (const AnswerPatch& patch : jumped.patches)
    EXPECT_LE(patch.views, 1);
}

TEST(Session, RiskIsToldInTheFrameOfTheAnswer)
{
  Random random;
  Settings settings;
  settings.foot = "point_foot";
  settings.load_direction = Eigen::Vector3d::UnitZ(); // the wall is the ground
  Session session(settings, fewPatches(), FakeTransforms{});
  const Answer answer = session.answer(wallFrame(random, 1));
  ASSERT_TRUE(answer.risk);
  EXPECT_FALSE(answer.risk->ranking.footholds.empty());
  EXPECT_EQ(answer.risk->load_direction, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(answer.risk->grid.layers.size(), kRiskLayerNames.size());
}

TEST(Session, TunesBetweenFrames)
{
  Random random;
  Session session(Settings(), fewPatches(), FakeTransforms{});
  Tuning larger = fewPatches();
  larger.radius_m = 0.08;
  session.tune(larger);
  for (const AnswerPatch& patch : session.answer(wallFrame(random, 1)).patches)
    EXPECT_EQ(patch.patch.radius_m, 0.08);
  larger.radius_m = -1.0;
  EXPECT_THROW(session.tune(larger), std::invalid_argument);
}

TEST(Session, RefusesSettingsThatMakeNoSense)
{
  const auto refused = [](void (*spoil)(Settings&)) {
    Settings settings;
    spoil(settings);
    EXPECT_ANY_THROW(Session(settings, Tuning(), FakeTransforms{}));
  };
  refused([](Settings& s) { s.sensor = "no_such_sensor"; });
  refused([](Settings& s) { s.foot = "no_such_foot"; });
  refused([](Settings& s) { s.motion_sigma_m = 0.0; });
  refused([](Settings& s) { s.yaws = 0; });
  refused([](Settings& s) { s.grid_resolution_m = 0.0; });
  refused([](Settings& s) { s.threads = -1; });
  refused([](Settings& s) { s.load_direction = Eigen::Vector3d::Zero(); });
  refused([](Settings& s) {
    s.map = true;
    s.surface = SurfaceRequest::Plane;
  });
}

}} // namespace holdfast::robot
