// Through the real OpenNI2 with a camera of our own (virtual_kinect). Verdicts depend
// on what happens, never on how long it takes: whoever waits, waits for a condition,
// and only a hang meets the time limit.
#include "io/openni2_file.h"
#include "support/random.h"
#include "support/run_program.h"
#include "virtual_kinect/scene.h"
#include "virtual_kinect/virtual_kinect.h"

#include <holdfast/io/openni2_grabber.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <pcl/exceptions.h>
#include <pcl/io/grabber.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

namespace holdfast { namespace {

using test::freshFolder;
using test::Random;
using test::readFile;
using test::writeFile;
using virtual_kinect::command;
using Kind = GrabberEvent::Kind;
using Colored = pcl::PointCloud<pcl::PointXYZRGBA>;

constexpr std::chrono::seconds kHang{120};

/// QVGA: the tests are about frames, not about pixels.
Openni2Options
smallImages(const std::string& device = "")
{
  Openni2Options options;
  options.device = device;
  options.width = 320;
  options.height = 240;
  // A busy computer that gives the camera no time is no stall.
  options.stall_periods = 100 * options.frames_per_second;
  return options;
}

/// Keeps what a grabber delivers, and lets tests wait for it. It may go before the
/// grabber does.
class Consumer {
public:
  explicit Consumer(Openni2Grabber& grabber)
  {
    grabber.registerCallback(std::function<void(const RangeFrame::ConstPtr&)>(
        [log = log_](const RangeFrame::ConstPtr& frame) {
          const std::lock_guard<std::mutex> lock(log->mutex);
          log->frames.push_back(frame);
          log->changed.notify_all();
        }));
    grabber.registerCallback(std::function<void(const GrabberEvent&)>(
        [log = log_](const GrabberEvent& event) {
          const std::lock_guard<std::mutex> lock(log->mutex);
          log->events.push_back(event);
          log->changed.notify_all();
        }));
  }

  /// Until there are so many. \return false when it hangs
  bool waitForFrames(std::size_t number) const
  {
    return waitFor([&] { return log_->frames.size() >= number; });
  }

  template <typename Condition>
  bool waitForFrame(Condition&& condition) const
  {
    return waitFor([&] {
      const auto& frames = log_->frames;
      return std::any_of(frames.begin(), frames.end(), [&](const auto& frame) {
        return condition(*frame);
      });
    });
  }

  bool waitForMoreFrames(std::size_t more) const
  {
    return waitForFrames(frames().size() + more);
  }

  bool waitForEvent(Kind kind, std::ptrdiff_t times = 1) const
  {
    return waitFor([&] {
      const auto& events = log_->events;
      return std::count_if(events.begin(), events.end(), [kind](const auto& event) {
               return event.kind == kind;
             }) >= times;
    });
  }

  bool waitForAnyEvent() const
  {
    return waitFor([&] { return !log_->events.empty(); });
  }

  std::vector<RangeFrame::ConstPtr> frames() const
  {
    const std::lock_guard<std::mutex> lock(log_->mutex);
    return log_->frames;
  }

  std::vector<GrabberEvent> events() const
  {
    const std::lock_guard<std::mutex> lock(log_->mutex);
    return log_->events;
  }

private:
  struct Log {
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<RangeFrame::ConstPtr> frames;
    std::vector<GrabberEvent> events;
  };

  template <typename Condition>
  bool waitFor(Condition&& condition) const
  {
    std::unique_lock<std::mutex> lock(log_->mutex);
    return log_->changed.wait_for(lock, kHang, condition);
  }

  std::shared_ptr<Log> log_ = std::make_shared<Log>();
};

/// The message of the exception that opening the device throws.
std::string
openingError(const Openni2Options& options)
{
  try {
    const Openni2Grabber grabber(options);
    return "none";
  }
  catch (const pcl::IOException& error) {
    return error.what();
  }
}

class Openni2GrabberTest : public testing::Test {
protected:
  void SetUp() override
  {
    listOpenni2Devices(); // loads the driver
    for (const char* order : {"devices 1",
                              "fps 30",
                              "color 1",
                              "depth 1",
                              "rgb 1",
                              "start_fails 0",
                              "mirror_sticks 0",
                              "unplug_at 0",
                              "replug_after_ms 0",
                              "stall_at 0",
                              "error_at 0"})
      command(order);
  }
};

void
expectPoint(const pcl::PointXYZ& actual, const Eigen::Vector3d& expected, int depth_mm)
{
  if (depth_mm == 0) {
    EXPECT_TRUE(std::isnan(actual.x) && std::isnan(actual.y) && std::isnan(actual.z));
    return;
  }
  EXPECT_EQ(actual.x, static_cast<float>(expected.x()));
  EXPECT_EQ(actual.y, static_cast<float>(expected.y()));
  EXPECT_EQ(actual.z, static_cast<float>(expected.z()));
}

/// Every pixel of a cloud against the scene, through this camera. \param shown the
/// frame of the scene that it shows
void
expectScene(const RangeFrame& frame, const Camera& camera, int shown)
{
  const int width = static_cast<int>(frame.cloud.points->width);
  const int height = static_cast<int>(frame.cloud.points->height);
  ASSERT_EQ(width, camera.width);
  ASSERT_EQ(height, camera.height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const int mm = virtual_kinect::depthMm(shown, u, v, width, height);
      expectPoint((*frame.cloud.points)(u, v), camera.backProject(u, v, mm * 1e-3), mm);
      ASSERT_FALSE(testing::Test::HasFailure()) << "at pixel " << u << ' ' << v;
    }
}

/// The frame of the scene that the colours are from: blue counts the first 255.
int
colorFrame(const RangeFrame& frame)
{
  return frame.colored->front().b;
}

/// Every pixel has the same position as in the cloud and the colour of one colour
/// frame: whether that is the depth's own is a question of what the computer has time
/// for.
void
expectColors(const RangeFrame& frame)
{
  ASSERT_TRUE(frame.colored);
  ASSERT_EQ(frame.colored->size(), frame.cloud.points->size());
  for (std::uint32_t v = 0; v < frame.colored->height; ++v)
    for (std::uint32_t u = 0; u < frame.colored->width; ++u) {
      const pcl::PointXYZ& p = (*frame.cloud.points)(u, v);
      const pcl::PointXYZRGBA& q = (*frame.colored)(u, v);
      const auto rgb = virtual_kinect::color(colorFrame(frame),
                                             static_cast<int>(u),
                                             static_cast<int>(v));
      ASSERT_TRUE(q.r == rgb[0] && q.g == rgb[1] && q.b == rgb[2]) << u << ' ' << v;
      ASSERT_TRUE(p.z == q.z || std::isnan(p.z));
    }
}

/// The first frame of the scene that a QVGA cloud may show, by the noise in one row; 0:
/// none.
int
shownFrame(const RangeFrame& frame)
{
  constexpr int kWidth = 320, kHeight = 240, kRow = kHeight / 2;
  const auto matches = [&](int shown) {
    for (int u = kWidth / 80; u < kWidth; ++u) {
      const int mm = virtual_kinect::depthMm(shown, u, kRow, kWidth, kHeight);
      if ((*frame.cloud.points)(u, kRow).z != static_cast<float>(mm * 1e-3))
        return false;
    }
    return true;
  };
  for (int shown = 1; shown <= virtual_kinect::kPeriod; ++shown)
    if (matches(shown))
      return shown;
  return 0;
}

/// The camera of a field of view, its axis through the middle of the image.
Camera
symmetricCamera(int width, int height, double horizontal_fov, double vertical_fov)
{
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = width / 2.0 / std::tan(horizontal_fov / 2.0);
  camera.fy = height / 2.0 / std::tan(vertical_fov / 2.0);
  camera.cx = (width - 1) / 2.0;
  camera.cy = (height - 1) / 2.0;
  return camera;
}

void
expectCamera(const Camera& actual, const Camera& expected)
{
  // The field of view is a float, so its tangent is good to a few 1e-7.
  EXPECT_NEAR(actual.fx, expected.fx, 1e-6 * expected.fx);
  EXPECT_NEAR(actual.fy, expected.fy, 1e-6 * expected.fy);
  EXPECT_EQ(actual.cx, expected.cx);
  EXPECT_EQ(actual.cy, expected.cy);
  EXPECT_EQ(actual.width, expected.width);
  EXPECT_EQ(actual.height, expected.height);
}

TEST_F(Openni2GrabberTest, CloudsAreTheSceneThroughTheCamera)
{
  for (const bool vga : {true, false}) {
    Openni2Options options = vga ? Openni2Options() : smallImages();
    options.noise = std::make_shared<StereoNoiseModel>(StereoNoiseModel::Parameters{});
    Openni2Grabber grabber(options);
    Consumer consumer(grabber);
    grabber.start();
    ASSERT_TRUE(consumer.waitForFrames(3));
    ASSERT_TRUE(consumer.waitForFrame([](const RangeFrame& frame) {
      return frame.colored && colorFrame(frame) == frame.index;
    }));
    grabber.stop();
    expectCamera(grabber.camera(),
                 symmetricCamera(options.width,
                                 options.height,
                                 virtual_kinect::kDepthHorizontalFov,
                                 virtual_kinect::kDepthVerticalFov));
    EXPECT_TRUE(grabber.hasColor());
    EXPECT_EQ(grabber.getFramesPerSecond(), 30.0F);
    for (const RangeFrame::ConstPtr& frame : consumer.frames()) {
      expectScene(*frame, grabber.camera(), frame->index);
      if (frame->colored)
        expectColors(*frame);
      EXPECT_EQ(frame->timestamp_us, virtual_kinect::timestampUs(frame->index));
      EXPECT_EQ(frame->cloud.points->header.stamp, frame->timestamp_us);
      EXPECT_EQ(validityError(frame->cloud), "");
      ASSERT_TRUE(frame->cloud.covariances);
      ASSERT_EQ(frame->cloud.covariances->size(), frame->cloud.points->size());
    }
  }
}

TEST_F(Openni2GrabberTest, CovariancesAreThoseOfTheNoiseModel)
{
  Openni2Options options = smallImages();
  const auto noise = std::make_shared<StereoNoiseModel>(StereoNoiseModel::Parameters{});
  options.noise = noise;
  Openni2Grabber grabber(options);
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrames(1));
  grabber.stop();
  const RangeCloud& cloud = consumer.frames().front()->cloud;
  for (std::size_t i = 0; i < cloud.points->size(); ++i) {
    const Eigen::Vector3f q = (*cloud.points)[i].getVector3fMap();
    if (!q.allFinite()) {
      EXPECT_TRUE((*cloud.covariances)[i].array().isNaN().all());
      continue;
    }
    const Eigen::Matrix3f expected = noise->covariance(q.cast<double>()).cast<float>();
    // Both are rounded to float once.
    ASSERT_LE(((*cloud.covariances)[i] - expected).norm(), 1e-6F * expected.norm());
  }
}

TEST_F(Openni2GrabberTest, RegisteredDepthIsSeenByTheColourCamera)
{
  Openni2Options options = smallImages();
  options.registration = true;
  expectCamera(Openni2Grabber(options).camera(),
               symmetricCamera(320,
                               240,
                               virtual_kinect::kColorHorizontalFov,
                               virtual_kinect::kColorVerticalFov));
  options.color = false;
  EXPECT_NE(openingError(options).find("cannot register"), std::string::npos);
}

TEST_F(Openni2GrabberTest, GivenIntrinsicsReplaceThoseOfTheDevice)
{
  Openni2Options options = smallImages();
  options.camera = symmetricCamera(320, 240, 1.0, 0.8);
  options.camera->cx = 161.25;
  Openni2Grabber grabber(options);
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrames(1));
  grabber.stop();
  const RangeFrame& frame = *consumer.frames().front();
  expectScene(frame, *options.camera, frame.index);
  options.camera->width = 640;
  EXPECT_NE(openingError(options).find("given camera"), std::string::npos);
}

TEST_F(Openni2GrabberTest, MirroredImagesAreTurned)
{
  command("mirror_sticks 1");
  Openni2Grabber grabber(smallImages());
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrame(
      [](const RangeFrame& frame) { return frame.colored != nullptr; }));
  grabber.stop();
  const RangeFrame& frame = *consumer.frames().back();
  expectScene(frame, grabber.camera(), frame.index);
  expectColors(frame);
}

TEST_F(Openni2GrabberTest, ServesTheCallbacksOfAPclGrabber)
{
  Openni2Grabber grabber(smallImages());
  pcl::Grabber& interface = grabber;
  std::atomic<int> points{0}, colored{0};
  interface.registerCallback(
      std::function<void(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr&)>(
          [&](const auto& cloud) { points += cloud->isOrganized(); }));
  interface.registerCallback(std::function<void(const Colored::ConstPtr&)>(
      [&](const auto& cloud) { colored += cloud->isOrganized(); }));
  EXPECT_THROW(interface.registerCallback(std::function<void(int)>([](int) {})),
               pcl::IOException);
  Consumer consumer(grabber);
  EXPECT_FALSE(interface.isRunning());
  interface.start();
  EXPECT_TRUE(interface.isRunning());
  EXPECT_EQ(interface.getName(), "Openni2Grabber");
  ASSERT_TRUE(consumer.waitForFrames(2));
  interface.stop();
  EXPECT_FALSE(interface.isRunning());
  EXPECT_GE(points, 2);
  EXPECT_GE(colored, 2);
}

TEST_F(Openni2GrabberTest, OpensDevicesByNumberAndUri)
{
  command("devices 3");
  ASSERT_EQ(listOpenni2Devices().size(), 3U);
  Openni2Grabber second(smallImages("#2"));
  Openni2Grabber third(smallImages("virtual://2"));
  Consumer consumers[] = {Consumer(second), Consumer(third)};
  second.start();
  third.start();
  ASSERT_TRUE(consumers[0].waitForFrames(3));
  command("unplug 2"); // the third alone
  ASSERT_TRUE(consumers[1].waitForEvent(Kind::Unplugged));
  ASSERT_TRUE(consumers[0].waitForMoreFrames(3));
  EXPECT_TRUE(consumers[0].events().empty());
  for (const char* none : {"#4", "#0", "17"})
    EXPECT_NE(openingError(smallImages(none)).find("there is no camera"),
              std::string::npos);
  EXPECT_NE(openingError(smallImages("virtual://7")).find("cannot open virtual://7"),
            std::string::npos);
}

TEST_F(Openni2GrabberTest, MissingSensorsAreClearErrorsOrMissed)
{
  command("devices 0");
  EXPECT_NE(openingError({}).find("no depth camera"), std::string::npos);
  command("devices 1");
  command("depth 0");
  EXPECT_NE(openingError({}).find("no depth sensor"), std::string::npos);
  command("depth 1");
  Openni2Options odd;
  odd.width = 800;
  EXPECT_NE(openingError(odd).find("640 x 480 at 30 Hz"), std::string::npos);
  odd.width = 0;
  EXPECT_THROW(Openni2Grabber{odd}, std::invalid_argument);
  for (const char* without : {"color 0", "rgb 0"}) {
    SetUp();
    command(without);
    Openni2Grabber grabber(smallImages());
    EXPECT_FALSE(grabber.hasColor());
    Consumer consumer(grabber);
    grabber.start();
    ASSERT_TRUE(consumer.waitForFrames(2));
    EXPECT_FALSE(consumer.frames().front()->colored);
  }
}

TEST_F(Openni2GrabberTest, StreamsThatDoNotStartAreAnError)
{
  command("start_fails 1");
  Openni2Grabber grabber(smallImages());
  EXPECT_THROW(grabber.start(), pcl::IOException);
  EXPECT_FALSE(grabber.isRunning());
  EXPECT_THROW(grabber.start(), pcl::IOException);
}

TEST_F(Openni2GrabberTest, SurvivesStartStopDestroyUnderLoad)
{
  command("fps 0");
  std::atomic<bool> done{false};
  std::vector<std::thread> load;
  for (int i = 0; i < 2; ++i)
    load.emplace_back([&done] {
      while (!done) {}
    });
  Random random;
  for (int cycle = 0; cycle < 200; ++cycle) {
    auto grabber = std::make_unique<Openni2Grabber>(smallImages());
    Consumer consumer(*grabber);
    const int starts = random.integer(1, 3);
    for (int i = 0; i < starts; ++i) {
      grabber->start();
      if (random.integer(0, 1) == 0) {
        ASSERT_TRUE(consumer.waitForMoreFrames(1));
      }
      if (i + 1 < starts || random.integer(0, 1) == 0)
        grabber->stop();
    }
    grabber.reset(); // running or not
    EXPECT_TRUE(consumer.events().empty());
  }
  done = true;
  for (std::thread& thread : load)
    thread.join();
}

TEST_F(Openni2GrabberTest, StartAndStopFromManyThreads)
{
  command("fps 0");
  Openni2Grabber grabber(smallImages());
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&grabber, i] {
      for (int n = 0; n < 25; ++n)
        (n + i) % 2 == 0 ? grabber.start() : grabber.stop();
    });
  for (std::thread& thread : threads)
    thread.join();
  Consumer consumer(grabber);
  grabber.start();
  EXPECT_TRUE(consumer.waitForFrames(1));
}

TEST_F(Openni2GrabberTest, StopsAndEndsFromItsOwnCallback)
{
  for (const bool destroy : {false, true}) {
    auto grabber = std::make_unique<Openni2Grabber>(smallImages());
    Consumer consumer(*grabber);
    std::mutex mutex;
    std::condition_variable changed;
    int calls = 0;
    grabber->registerCallback(std::function<void(const RangeFrame::ConstPtr&)>(
        [&, destroy](const RangeFrame::ConstPtr&) {
          grabber->stop();
          grabber->start(); // and think better of it, once
          const std::lock_guard<std::mutex> lock(mutex);
          if (++calls == 2)
            destroy ? grabber.reset() : grabber->stop();
          changed.notify_all();
        }));
    grabber->start();
    {
      std::unique_lock<std::mutex> lock(mutex);
      ASSERT_TRUE(changed.wait_for(lock, kHang, [&] { return calls == 2; }));
    }
    if (destroy) {
      EXPECT_EQ(grabber, nullptr);
      // The device is closed when the callback has returned.
      while (openingError(smallImages()) != "none")
        std::this_thread::yield();
      continue;
    }
    EXPECT_FALSE(grabber->isRunning());
    grabber->stop();
    EXPECT_EQ(calls, 2);
  }
}

TEST_F(Openni2GrabberTest, ExceptionsOfCallbacksAreReported)
{
  Openni2Grabber grabber(smallImages());
  Consumer consumer(grabber);
  grabber.registerCallback(
      std::function<void(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr&)>(
          [](const auto&) { throw std::runtime_error("no room"); }));
  grabber.start();
  ASSERT_TRUE(consumer.waitForEvent(Kind::CallbackFailed, 2));
  EXPECT_NE(consumer.events().front().message.find("no room"), std::string::npos);
  EXPECT_TRUE(consumer.waitForFrames(2)) << "the others are still served";
}

TEST_F(Openni2GrabberTest, ReportsUnpluggingAndReconnects)
{
  Openni2Grabber grabber(smallImages());
  Consumer consumer(grabber);
  grabber.start();
  for (int time = 1; time <= 3; ++time) {
    ASSERT_TRUE(consumer.waitForMoreFrames(2));
    command("unplug 0");
    ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged, time));
    EXPECT_TRUE(grabber.isRunning());
    command("plug 0");
    ASSERT_TRUE(consumer.waitForEvent(Kind::Recovered, time));
  }
  grabber.stop();
  EXPECT_EQ(consumer.events().size(), 6U) << "one failure, one recovery each";
  EXPECT_EQ(grabber.statistics().failures, 3U);
  const RangeFrame& last = *consumer.frames().back();
  expectScene(last, grabber.camera(), last.index);
}

TEST_F(Openni2GrabberTest, FindsTheCameraAgainUnderAnotherUri)
{
  command("devices 2");
  Openni2Grabber grabber(smallImages("virtual://0"));
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrames(1));
  command("unplug 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged));
  command("plug 5");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Recovered));
  EXPECT_EQ(consumer.events().back().message, "virtual://5 delivers frames again")
      << "not virtual://1, which is another camera";
}

TEST_F(Openni2GrabberTest, StopsAndEndsWhileTheDeviceIsGone)
{
  auto grabber = std::make_unique<Openni2Grabber>(smallImages());
  Consumer consumer(*grabber);
  grabber->start();
  command("unplug 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged));
  grabber->stop();
  EXPECT_THROW(grabber->start(), pcl::IOException);
  command("plug 0");
  grabber->start();
  EXPECT_TRUE(consumer.waitForMoreFrames(1));
  command("unplug 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged, 2));
  grabber.reset();
}

TEST_F(Openni2GrabberTest, KeepsTryingUntilTheDeviceWorksAgain)
{
  Openni2Grabber grabber(smallImages());
  Consumer consumer(grabber);
  grabber.start();
  std::ptrdiff_t times = 0;
  for (const auto& [broken, mended] :
       {std::pair("start_fails 1", "start_fails 0"), std::pair("depth 0", "depth 1")}) {
    ASSERT_TRUE(consumer.waitForMoreFrames(1));
    command(broken);
    command("unplug 0");
    ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged, ++times));
    command("plug 0");
    // Time for some attempts; how many does not matter.
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    EXPECT_TRUE(grabber.isRunning());
    command(mended);
    ASSERT_TRUE(consumer.waitForEvent(Kind::Recovered, times));
  }
  EXPECT_EQ(consumer.events().size(), 4U);
}

TEST_F(Openni2GrabberTest, StartsAgainWithADeviceThatWasAwayMeanwhile)
{
  Openni2Grabber grabber(smallImages());
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrames(1));
  grabber.stop();
  command("unplug 0");
  command("plug 0");
  grabber.start();
  EXPECT_TRUE(consumer.waitForMoreFrames(2));
  EXPECT_TRUE(consumer.events().empty());
}

TEST_F(Openni2GrabberTest, WithoutReconnectAFailureIsTheEnd)
{
  Openni2Options options = smallImages();
  options.reconnect = false;
  Openni2Grabber grabber(options);
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrames(1));
  command("unplug 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged));
  EXPECT_FALSE(grabber.isRunning());
}

TEST_F(Openni2GrabberTest, ReportsStallsAndErrorsAndRecovers)
{
  Openni2Options options = smallImages();
  options.stall_periods = 15;
  Openni2Grabber grabber(options);
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForFrames(2));
  command("stall 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Stalled));
  ASSERT_TRUE(consumer.waitForEvent(Kind::Recovered)) << "by opening the device again";
  command("error 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::DeviceError));
  ASSERT_TRUE(consumer.waitForEvent(Kind::Recovered, 2));
}

TEST_F(Openni2GrabberTest, SlowConsumersGetTheNewestFrame)
{
  command("fps 0");
  Openni2Grabber grabber(smallImages());
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<int> indices;
  grabber.registerCallback(std::function<void(const RangeFrame::ConstPtr&)>(
      [&](const RangeFrame::ConstPtr& frame) {
        const std::lock_guard<std::mutex> lock(mutex);
        indices.push_back(frame->index);
        changed.notify_all();
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
      }));
  grabber.start();
  {
    std::unique_lock<std::mutex> lock(mutex);
    ASSERT_TRUE(changed.wait_for(lock, kHang, [&] {
      return indices.size() >= 5 &&
             indices.back() > 2 * static_cast<int>(indices.size());
    }));
  }
  grabber.stop();
  for (std::size_t i = 1; i < indices.size(); ++i)
    EXPECT_GT(indices[i], indices[i - 1]);
  const GrabberStatistics statistics = grabber.statistics();
  EXPECT_EQ(statistics.delivered, indices.size());
  EXPECT_EQ(statistics.delivered + statistics.dropped,
            static_cast<std::uint64_t>(indices.back() - indices.front() + 1));
  EXPECT_GT(statistics.dropped, 0U);
}

/// Until so many depth images are in a file that is being written. OpenNI2 writes on a
/// thread of its own, and misses what comes before that is ready.
void
waitUntilWritten(const std::string& path, std::ptrdiff_t frames)
{
  const auto deadline = std::chrono::steady_clock::now() + kHang;
  const auto written = [&path]() -> std::ptrdiff_t {
    try {
      const auto all = io::readOniFile(path).frames;
      return std::count_if(all.begin(), all.end(), [](const auto& frame) {
        return frame.is_depth;
      });
    }
    catch (const pcl::IOException&) {
      return 0; // none yet
    }
  };
  while (written() < frames) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "hangs";
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

/// A recording of at least `frames` frames, and what a consumer saw meanwhile.
std::vector<RangeFrame::ConstPtr>
record(const std::string& path, std::ptrdiff_t frames)
{
  Openni2Grabber grabber(smallImages());
  Consumer consumer(grabber);
  grabber.startRecording(path);
  grabber.start();
  waitUntilWritten(path, frames);
  grabber.stop();
  grabber.stopRecording();
  return consumer.frames();
}

void
expectSameBits(const RangeFrame& a, const RangeFrame& b)
{
  ASSERT_EQ(a.cloud.points->size(), b.cloud.points->size());
  EXPECT_EQ(std::memcmp(a.cloud.points->data(),
                        b.cloud.points->data(),
                        a.cloud.points->size() * sizeof(pcl::PointXYZ)),
            0);
}

TEST_F(Openni2GrabberTest, PlaysBackWhatWasRecordedBitForBit)
{
  const std::string path = freshFolder("openni2_playback") + "/scene.oni";
  const auto seen = record(path, 12);
  Openni2Options options = smallImages(path);
  options.playback = Playback::EveryFrame;
  Openni2Grabber grabber(options);
  for (int round = 1; round <= 2; ++round) {
    Consumer consumer(grabber);
    grabber.start();
    ASSERT_TRUE(consumer.waitForEvent(Kind::EndOfRecording));
    EXPECT_FALSE(grabber.isRunning());
    EXPECT_EQ(consumer.events().size(), 1U);
    const auto played = consumer.frames();
    ASSERT_FALSE(played.empty());
    const int first = shownFrame(*played.front());
    for (std::size_t i = 0; i < played.size(); ++i) {
      EXPECT_EQ(played[i]->index, static_cast<int>(i) + 1);
      expectScene(*played[i], grabber.camera(), first + static_cast<int>(i));
      expectColors(*played[i]);
      // Each stream counts from where its own recording began.
      EXPECT_LE(std::abs(colorFrame(*played[i]) - first - static_cast<int>(i)), 1);
    }
    for (const RangeFrame::ConstPtr& frame : seen) {
      if (frame->index < first)
        continue; // the writer was not ready yet
      ASSERT_LT(frame->index - first, static_cast<int>(played.size()));
      expectSameBits(*frame, *played[static_cast<std::size_t>(frame->index - first)]);
    }
  }
  EXPECT_EQ(grabber.statistics().dropped, 0U);
}

TEST(OniFile, ReadsTheLastPixelsThatTheRecorderMisplaces)
{
  io::OniStream stream;
  stream.codec = 0x547A3631; // "16zT"
  stream.width = 4;
  stream.height = 1;
  // Two depths, 500 and 600; the first; a single step up; one pair of equal pixels,
  // which is meant to come before the step.
  const std::vector<std::uint8_t> code =
      {2, 0, 0xF4, 0x01, 0x58, 0x02, 0, 0, 0x5D, 0xE1};
  EXPECT_EQ(io::decodeDepth(stream, code),
            (std::vector<std::uint16_t>{500, 500, 500, 600}));
  for (std::size_t size = 0; size < code.size(); ++size)
    EXPECT_THROW(io::decodeDepth(stream, {code.begin(), code.begin() + size}),
                 pcl::IOException);
}

TEST_F(Openni2GrabberTest, PlaysBackAtRecordedSpeed)
{
  const std::string path = freshFolder("openni2_speed") + "/scene.oni";
  record(path, 8);
  Openni2Grabber grabber(smallImages(path));
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForEvent(Kind::EndOfRecording));
  const auto played = consumer.frames();
  ASSERT_FALSE(played.empty());
  const int first = shownFrame(*played.front()) - played.front()->index;
  for (const RangeFrame::ConstPtr& frame : played) // a busy computer may miss some
    expectScene(*frame, grabber.camera(), first + frame->index);
}

TEST_F(Openni2GrabberTest, PlaybackOfEveryFrameWaitsForASlowConsumer)
{
  const std::string path = freshFolder("openni2_slow") + "/scene.oni";
  record(path, 8);
  Openni2Options options = smallImages(path);
  options.playback = Playback::EveryFrame;
  Openni2Grabber grabber(options);
  grabber.registerCallback(std::function<void(const RangeFrame::ConstPtr&)>(
      [](const auto&) { std::this_thread::sleep_for(std::chrono::milliseconds(40)); }));
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForEvent(Kind::EndOfRecording));
  EXPECT_EQ(grabber.statistics().dropped, 0U);
  EXPECT_GE(grabber.statistics().delivered, 8U);
}

TEST_F(Openni2GrabberTest, PlaybackCanBeRepeatedFromItsEnd)
{
  const std::string path = freshFolder("openni2_repeat") + "/scene.oni";
  record(path, 3);
  Openni2Options options = smallImages(path);
  options.playback = Playback::EveryFrame;
  Openni2Grabber grabber(options);
  std::atomic<int> rounds{0};
  grabber.registerCallback(
      std::function<void(const GrabberEvent&)>([&](const GrabberEvent&) {
        if (++rounds < 3)
          grabber.start();
      }));
  Consumer consumer(grabber);
  grabber.start();
  ASSERT_TRUE(consumer.waitForEvent(Kind::EndOfRecording, 3));
  grabber.stop();
  const auto played = consumer.frames();
  ASSERT_EQ(played.size() % 3, 0U);
  const std::size_t length = played.size() / 3;
  EXPECT_GE(length, 3U);
  for (std::size_t i = 0; i < length; ++i) {
    expectSameBits(*played[i], *played[i + length]);
    expectSameBits(*played[i], *played[i + 2 * length]);
  }
}

/// Every frame of a recording, and how it ended, in one line.
std::pair<std::vector<RangeFrame::ConstPtr>, std::string>
playToTheEnd(const std::string& path)
{
  Openni2Options options = smallImages(path);
  options.playback = Playback::EveryFrame;
  try {
    Openni2Grabber grabber(options);
    Consumer consumer(grabber);
    grabber.start();
    if (!consumer.waitForAnyEvent())
      return {{}, "hangs"};
    return {consumer.frames(), consumer.events().back().message};
  }
  catch (const pcl::IOException& error) {
    return {{}, error.what()};
  }
}

/// Cuts a recording off anywhere: what is complete must still be played.
void
expectPlayableUpToACut(const std::string& recording, const std::string& path)
{
  std::string bytes = readFile(recording);
  // Behind the last record, OpenNI2 leaves a hole as large as all before it.
  bytes.resize(std::min(bytes.size(), bytes.rfind(std::string("NIR\0\x0b", 5))));
  const auto whole = playToTheEnd(recording).first;
  Random random;
  std::size_t longest = 0;
  for (int i = 0; i < 30; ++i) {
    const auto length =
        static_cast<std::size_t>(random.integer(0, static_cast<int>(bytes.size()) - 1));
    writeFile(path, bytes.substr(0, length));
    const auto [played, outcome] = playToTheEnd(path);
    if (played.empty()) {
      EXPECT_EQ(outcome.rfind(path + ": ", 0), 0U) << outcome;
      continue;
    }
    EXPECT_EQ(outcome, path + " breaks off: it was not closed");
    longest = std::max(longest, played.size());
    // Images follow each other in the file, those of depth and colour by turns.
    EXPECT_NEAR(static_cast<double>(played.size()),
                static_cast<double>(whole.size() * length) /
                    static_cast<double>(bytes.size()),
                2.0);
    for (std::size_t k = 0; k < played.size(); ++k)
      expectSameBits(*played[k], *whole[k]);
  }
  EXPECT_GT(longest, whole.size() / 2);
}

TEST_F(Openni2GrabberTest, RecordingsThatAreCutOffPlayUpToTheCut)
{
  const std::string folder = freshFolder("openni2_cut");
  const std::string running = folder + "/running.oni";
  const std::string copy = folder + "/copy.oni";
  Openni2Grabber grabber(smallImages());
  grabber.startRecording(running);
  grabber.start();
  waitUntilWritten(running, 8);
  // What would be left if the program were killed now.
  std::filesystem::copy_file(running, copy);
  grabber.stop();
  const auto [played, outcome] = playToTheEnd(copy);
  EXPECT_EQ(outcome, copy + " breaks off: it was not closed");
  ASSERT_GE(played.size(), 8U);
  const int first = shownFrame(*played.front());
  for (std::size_t i = 0; i < played.size(); ++i)
    expectScene(*played[i], grabber.camera(), first + static_cast<int>(i));
  expectPlayableUpToACut(copy, folder + "/cut.oni");

  grabber.stopRecording();
  expectPlayableUpToACut(running, folder + "/cut.oni");
}

TEST_F(Openni2GrabberTest, PlaybackCanBeStoppedAnywhere)
{
  const std::string path = freshFolder("openni2_stop") + "/scene.oni";
  record(path, 5);
  for (int cycle = 0; cycle < 40; ++cycle) {
    Openni2Options options = smallImages(path);
    options.playback = cycle % 2 == 0 ? Playback::EveryFrame : Playback::RecordedSpeed;
    Openni2Grabber grabber(options);
    Consumer consumer(grabber);
    grabber.start();
    if (cycle % 3 != 0) {
      ASSERT_TRUE(consumer.waitForFrames(1));
    }
  }
}

TEST_F(Openni2GrabberTest, RecordingReportsWhatItCannotDo)
{
  const std::string folder = freshFolder("openni2_recording");
  Openni2Grabber grabber(smallImages());
  EXPECT_THROW(grabber.startRecording(folder + "/no/such/folder.oni"),
               pcl::IOException);
  EXPECT_THROW(grabber.startRecording(folder), pcl::IOException);
  grabber.stopRecording();
  grabber.startRecording(folder + "/empty.oni");
  EXPECT_THROW(grabber.startRecording(folder + "/second.oni"), pcl::IOException);
  command("plug 1");
  EXPECT_THROW(Openni2Grabber(smallImages("#2")).startRecording(folder + "/other.oni"),
               pcl::IOException)
      << "while the first one records";
  EXPECT_FALSE(std::filesystem::exists(folder + "/other.oni"));
  EXPECT_THROW(grabber.stopRecording(), pcl::IOException) << "it holds no frame";

  // Unplugging ends the recording; what was recorded can be played.
  Consumer consumer(grabber);
  grabber.startRecording(folder + "/unplugged.oni");
  grabber.start();
  waitUntilWritten(folder + "/unplugged.oni", 5);
  command("unplug 0");
  ASSERT_TRUE(consumer.waitForEvent(Kind::Unplugged));
  EXPECT_EQ(openingError(smallImages(folder + "/unplugged.oni")), "none");

  Openni2Grabber player(smallImages(folder + "/unplugged.oni"));
  EXPECT_THROW(player.startRecording(folder + "/copy.oni"), pcl::IOException);
}

TEST_F(Openni2GrabberTest, FilesThatAreNoRecordingsAreClearErrors)
{
  const std::string folder = freshFolder("openni2_no_recordings");
  const std::string path = folder + "/file.oni";
  EXPECT_EQ(openingError(smallImages(path)), path + ": no such file");
  writeFile(path, "");
  EXPECT_EQ(openingError(smallImages(path)), path + ": is empty");
  Random random;
  for (int size : {1, 23, 24, 100, 100000}) {
    std::string bytes(static_cast<std::size_t>(size), '\0');
    for (char& byte : bytes)
      byte = static_cast<char>(random.integer(0, 255));
    writeFile(path, bytes);
    EXPECT_EQ(openingError(smallImages(path)).rfind(path + ": ", 0), 0U);
    if (size > 24) {
      writeFile(path, "NI10" + std::string("\1\0\1\0\0\0\0\0", 8) + bytes);
      EXPECT_EQ(openingError(smallImages(path)).rfind(path + ": ", 0), 0U);
    }
  }
  std::filesystem::create_directory(folder + "/folder.oni");
  EXPECT_NE(openingError(smallImages(folder + "/folder.oni")).find("no regular file"),
            std::string::npos);
}

TEST_F(Openni2GrabberTest, DamagedRecordingsNeitherCrashNorHang)
{
  const std::string folder = freshFolder("openni2_damaged");
  record(folder + "/good.oni", 2);
  const std::string good = readFile(folder + "/good.oni");
  const std::string path = folder + "/bad.oni";
  Random random;
  // The descriptions of the streams come first, the pixels later.
  for (const int reach : {1700, static_cast<int>(good.size()) - 1})
    for (int i = 0; i < 40; ++i) {
      std::string bytes = good;
      const auto at = static_cast<std::size_t>(random.integer(0, reach));
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.integer(0, 7)));
      writeFile(path, bytes);
      const std::string outcome = playToTheEnd(path).second;
      EXPECT_NE(outcome, "hangs") << "byte " << at;
      EXPECT_NE(outcome, "") << "byte " << at;
    }
}

}} // namespace holdfast
