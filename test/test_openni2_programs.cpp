// `holdfast live` and `record` through the real OpenNI2 with a camera of our own
// (virtual_kinect). Verdicts depend on what is written, never on how fast.
#include "support/run_program.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/io/pattern_map_file.h>
#include <holdfast/pcl/pattern_subtraction.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <thread>

namespace holdfast { namespace {

using Json = nlohmann::json;
using test::filesIn;
using test::freshFolder;
using test::readFile;
using test::runProgram;

using Arguments = std::vector<std::string>;

/// Small images and few patches: the tests are about the road.
const Arguments kQuick{"--size", "320x240", "--max-patches", "20", "--radius", "0.04"};

/// The orders of the virtual camera, for programs started meanwhile.
class Camera {
public:
  explicit Camera(const std::string& orders)
  {
    ::setenv("VIRTUAL_KINECT", orders.c_str(), 1);
  }
  ~Camera()
  {
    ::unsetenv("VIRTUAL_KINECT");
  }
};

Arguments
operator+(Arguments a, const Arguments& b)
{
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<Json>
jsonLines(const std::string& text)
{
  std::vector<Json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    lines.push_back(Json::parse(line));
  return lines;
}

/// A program that can be listened to, and hit, while it runs.
class RunningProgram {
public:
  /// \param max_file_bytes writing more fails, as on a full disk; 0: no limit
  RunningProgram(const Arguments& arguments, rlim_t max_file_bytes = 0)
  {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
      throw std::runtime_error("no pipe");
    pid_ = ::fork();
    if (pid_ == 0)
      execute(arguments, ends[1], max_file_bytes);
    ::close(ends[1]);
    output_ = ::fdopen(ends[0], "r");
  }
  ~RunningProgram()
  {
    closeOutput();
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      wait();
    }
  }

  /// Empty at the end of the output.
  std::string readLine()
  {
    std::string line;
    for (int c = 0; (c = std::fgetc(output_)) != EOF && c != '\n';)
      line += static_cast<char>(c);
    return line;
  }
  void signal(int number) const
  {
    ::kill(pid_, number);
  }
  void closeOutput()
  {
    if (output_ != nullptr)
      std::fclose(output_);
    output_ = nullptr;
  }
  /// \return exit code, or 128 + signal.
  int wait()
  {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

private:
  [[noreturn]] static void execute(const Arguments& arguments,
                                   int output,
                                   rlim_t max_file_bytes)
  {
    ::dup2(output, STDOUT_FILENO);
    ::dup2(::open("/dev/null", O_WRONLY), STDERR_FILENO);
    if (max_file_bytes > 0) {
      const rlimit limit{max_file_bytes, max_file_bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      std::signal(SIGXFSZ, SIG_IGN);
    }
    std::vector<char*> words{const_cast<char*>(HOLDFAST_PROGRAM)};
    for (const std::string& argument : arguments)
      words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    ::execv(HOLDFAST_PROGRAM, words.data());
    ::_exit(127);
  }

  pid_t pid_ = 0;
  FILE* output_ = nullptr;
};

/// Number of frames in a recording, by playing it.
std::size_t
countFrames(const std::string& folder, const std::string& recording)
{
  const auto run =
      runProgram(folder,
                 Arguments{"live", "--device", recording, "--every-frame"} + kQuick +
                     Arguments{"--json-lines", "-", "--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return jsonLines(run.out).size();
}

TEST(LiveProgram, WritesALineOfJsonPerFrame)
{
  const std::string folder = freshFolder("live_json");
  const auto run =
      runProgram(folder,
                 Arguments{"live", "--json-lines", "-", "--frames", "6"} + kQuick);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::vector<Json> frames = jsonLines(run.out);
  ASSERT_EQ(frames.size(), 6U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i]["cloud"], "frame_00000" + std::to_string(i + 1));
    EXPECT_EQ(frames[i]["sensor"]["camera"]["width"], 320);
    EXPECT_LE(frames[i]["patches"].size(), 20U);
    if (i > 0) {
      EXPECT_GT(frames[i]["timestamp_us"], frames[i - 1]["timestamp_us"]);
    }
  }
  // The summary is for people, and standard output is taken.
  EXPECT_NE(run.err.find("latency"), std::string::npos) << run.err;
}

TEST(LiveProgram, PlaysARecordingAlikeEveryTime)
{
  const std::string folder = freshFolder("live_playback");
  const std::string recording = folder + "/walk.oni";
  const auto recorded =
      runProgram(folder,
                 {"record", "-o", recording, "--size", "320x240", "--frames", "8"});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  EXPECT_NE(recorded.out.find("8 frames in"), std::string::npos) << recorded.out;

  const auto play = [&](const std::string& threads) {
    const auto run = runProgram(
        folder,
        Arguments{"live", "--device", recording, "--every-frame", "--json-lines", "-"} +
            kQuick + Arguments{"--budget-ms", "1e6", "--threads", threads});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.err.find(" 0 dropped"), std::string::npos) << run.err;
    std::vector<Json> frames = jsonLines(run.out);
    for (Json& frame : frames) {
      EXPECT_EQ(frame["patches"].size(), 20U);
      frame.erase("timing");
    }
    return frames;
  };
  const std::vector<Json> once = play("1");
  EXPECT_GE(once.size(), 1U); // OpenNI2 may miss the first, before its writer is ready
  EXPECT_EQ(once, play("3"));

  const std::string frames = folder + "/frames";
  const auto unpacked =
      runProgram(folder,
                 {"record", "-o", frames, "--device", recording, "--every-frame"});
  EXPECT_EQ(unpacked.exit_code, 0) << unpacked.err;
  EXPECT_EQ(filesIn(frames).size(), once.size());
}

TEST(LiveProgram, WritesPatchFilesAndRecordsMeanwhile)
{
  const std::string folder = freshFolder("live_files");
  const std::string frames = folder + "/frames";
  const std::string patches = folder + "/patches";
  const auto run =
      runProgram(folder,
                 Arguments{"live", "--record", frames, "-o", patches, "--frames", "2"} +
                     kQuick + Arguments{"--budget-ms", "1e6"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(filesIn(frames), (Arguments{"frame_000001.pcd", "frame_000002.pcd"}));
  EXPECT_EQ(filesIn(patches).size(), 6U);
  // The same patches from the file as from the camera.
  const Json live = Json::parse(readFile(patches + "/frame_000002.patches.json"));
  EXPECT_EQ(live["patches"].size(), 20U);
  const auto fit =
      runProgram(folder, {"fit", frames + "/frame_000002.pcd", "--radius", "0.04"});
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
  // A second recording must not mix with the first.
  const auto again = runProgram(folder, {"record", "-o", frames, "--frames", "1"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("holds frames already"), std::string::npos) << again.err;
}

/// A sensor file whose pattern map has another error in every pixel of a small image.
class MappedSensor {
public:
  explicit MappedSensor(const std::string& folder)
  : file_(folder + "/mapped.yaml"), errors_(320 * 240)
  {
    for (std::size_t i = 0; i < errors_.size(); ++i)
      errors_[i] = static_cast<float>(256 + i % 320) / 1024.0F; // as a file has them
    Sensor sensor;
    sensor.name = "mapped";
    sensor.camera = {320, 240, 290.0, 290.0, 159.5, 119.5};
    const StereoNoiseModel::Parameters stereo;
    sensor.noise = std::make_shared<StereoNoiseModel>(stereo);
    sensor.pattern_map = std::make_shared<const PatternMap>(320, 240, errors_);
    savePatternMap(folder + "/map.png", *sensor.pattern_map);
    saveSensor(file_,
               sensor,
               {{"sigma_disparity_px", stereo.sigma_disparity_px},
                {"sigma_point_px", stereo.sigma_point_px},
                {"baseline_m", stereo.baseline_m},
                {"focal_px", stereo.focal_px}},
               {},
               "map.png");
    focal_times_baseline_ = stereo.focal_px * stereo.baseline_m;
  }

  const std::string& file() const
  {
    return file_;
  }

  /// A point of a frame without the error of its pixel.
  Eigen::Vector3d without(const Eigen::Vector3d& point, std::size_t pixel) const
  {
    return withoutDisparityError(point, errors_.at(pixel), focal_times_baseline_);
  }

private:
  std::string file_;
  std::vector<float> errors_;
  double focal_times_baseline_ = 0.0;
};

TEST(LiveProgram, SubtractsThePatternMap)
{
  const std::string folder = freshFolder("live_map");
  const MappedSensor sensor(folder);
  for (const bool subtract : {true, false}) {
    const std::string frames = folder + (subtract ? "/less" : "/raw");
    const auto run =
        runProgram(folder,
                   Arguments{"live",
                             "--record",
                             frames,
                             "-o",
                             frames + "_patches",
                             "--frames",
                             "1",
                             "--sensor",
                             sensor.file()} +
                       kQuick + Arguments{"--budget-ms", "1e6"} +
                       (subtract ? Arguments{} : Arguments{"--no-pattern"}));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const RangeCloud measured = loadCloud(frames + "/frame_000001.pcd");
    const Json live =
        Json::parse(readFile(frames + "_patches/frame_000001.patches.json"));
    ASSERT_EQ(live["patches"].size(), 20U);
    for (const Json& patch : live["patches"]) {
      const std::size_t pixel = patch["seed"]["index"];
      const Json& seed = patch["seed"]["point"];
      const Eigen::Vector3d found(seed[0], seed[1], seed[2]);
      const Eigen::Vector3d point =
          (*measured.points)[pixel].getVector3fMap().cast<double>();
      EXPECT_LT((found - (subtract ? sensor.without(point, pixel) : point)).norm(),
                1e-6);
    }
  }
  const auto other = runProgram(
      folder,
      {"live", "--frames", "1", "--size", "640x480", "--sensor", sensor.file()});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_EQ(other.errorLines(), 1) << other.err;
  EXPECT_NE(other.err.find("where the pattern map of the sensor mapped has 320 x 240"),
            std::string::npos)
      << other.err;
}

TEST(LiveProgram, KeepsAMap)
{
  const std::string folder = freshFolder("live_fused");
  const std::string json = folder + "/live.json", stored = folder + "/live.map";
  const auto run =
      runProgram(folder,
                 Arguments{"live", "--frames", "3", "--map", json, "--map", stored} +
                     kQuick + Arguments{"--budget-ms", "1e6"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::ifstream file(json);
  const auto object = Json::parse(file);
  ASSERT_FALSE(object.at("patches").empty());
  EXPECT_TRUE(object.at("patches").front().contains("map"));
  EXPECT_GT(std::filesystem::file_size(stored), 0u);
  const auto wrong =
      runProgram(folder,
                 Arguments{"live", "--frames", "1", "--map", folder + "/m.txt"});
  EXPECT_EQ(wrong.exit_code, 2);
}

TEST(LiveProgram, AnInterruptEndsItWithCompleteFiles)
{
  const std::string folder = freshFolder("live_interrupt");
  const std::string recording = folder + "/walk.oni";
  RunningProgram program(Arguments{"live", "--json-lines", "-", "--record", recording} +
                         kQuick);
  for (int i = 0; i < 20; ++i)
    ASSERT_TRUE(Json::accept(program.readLine()));
  program.signal(SIGINT);
  for (std::string line; !(line = program.readLine()).empty();)
    EXPECT_TRUE(Json::accept(line));
  EXPECT_EQ(program.wait(), 0);
  EXPECT_GE(countFrames(folder, recording), 1U);
}

TEST(RecordProgram, SignalsEndItWithCompleteFrames)
{
  const std::string folder = freshFolder("record_signals");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const std::string frames = folder + "/frames_" + std::to_string(signal);
    RunningProgram program({"record", "-o", frames});
    while (!std::filesystem::exists(frames + "/frame_000002.pcd"))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    program.signal(signal);
    EXPECT_EQ(program.wait(), 0) << signal;
    for (const std::string& name : filesIn(frames))
      EXPECT_EQ(name.size(), std::string("frame_000001.pcd").size()) << name;
  }
}

TEST(LiveProgram, WithoutThreadsOrMemoryItEndsWithALine)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need more memory than that";
#endif
  const std::string folder = freshFolder("live_memory");
  int refused = 0;
  for (int megabytes = 150; megabytes < 300; megabytes += 8) {
    const std::string script =
        "ulimit -c 0; ulimit -v " + std::to_string(1024 * megabytes) +
        "; exec timeout 60 " + test::shellQuoted(HOLDFAST_PROGRAM) +
        " live --quiet --no-reconnect --frames 2 --max-patches 20";
    const auto run = test::runExecutable(folder, "/bin/sh", {"-c", script});
    SCOPED_TRACE(std::to_string(megabytes) + " MB: " + run.err);
    if (run.exit_code == 127) // the system cannot load the program
      continue;
    ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.exit_code;
    if (run.exit_code == 0)
      continue;
    ++refused;
    EXPECT_EQ(run.err.rfind("holdfast: ", 0), 0U);
    EXPECT_LE(run.errorLines(), 2); // what failed, and what came of it
  }
  std::cout << refused << " runs were refused\n";
}

TEST(LiveProgram, WhatAKilledProgramRecordedCanBePlayed)
{
  const std::string folder = freshFolder("live_killed");
  const std::string recording = folder + "/walk.oni";
  const std::string frames = folder + "/frames";
  for (const std::string& output : {recording, frames}) {
    RunningProgram program(Arguments{"live", "--json-lines", "-", "--record", output} +
                           kQuick);
    for (int i = 0; i < 20; ++i)
      ASSERT_TRUE(Json::accept(program.readLine()));
    program.signal(SIGKILL);
    EXPECT_EQ(program.wait(), 128 + SIGKILL);
  }
  EXPECT_GE(countFrames(folder, recording), 1U);
  std::size_t complete = 0;
  for (const std::string& name : filesIn(frames))
    if (name.size() == std::string("frame_000001.pcd").size()) {
      ++complete;
      EXPECT_EQ(runProgram(folder, {"info", frames + "/" + name}).exit_code, 0) << name;
    }
  EXPECT_GE(complete, 10U);
}

TEST(LiveProgram, AFullDiskIsAnErrorAndLeavesWhatFitted)
{
  const std::string folder = freshFolder("live_full");
  const std::string recording = folder + "/walk.oni";
  {
    // Some frames fit into 2 MB; those of the folder, of 1.2 MB each, one by one.
    RunningProgram program({"record", "-o", recording, "--frames", "60"}, 2000000);
    EXPECT_EQ(program.wait(), 1);
  }
  EXPECT_GE(countFrames(folder, recording), 1U);
  const std::string frames = folder + "/frames";
  {
    RunningProgram program({"record", "-o", frames, "--frames", "60"}, 1000000);
    EXPECT_EQ(program.wait(), 1);
  }
  EXPECT_TRUE(filesIn(frames).empty());
}

TEST(LiveProgram, AReaderThatGoesEndsIt)
{
  RunningProgram program(Arguments{"live", "--json-lines", "-"} + kQuick);
  ASSERT_TRUE(Json::accept(program.readLine()));
  program.closeOutput();
  EXPECT_EQ(program.wait(), 1);
}

TEST(LiveProgram, TheCameraMayGoAndComeBack)
{
  const std::string folder = freshFolder("live_unplugged");
  const Camera camera("unplug_at 5; replug_after_ms 50");
  const auto run =
      runProgram(folder, Arguments{"live", "--frames", "8", "--quiet"} + kQuick);
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.err.find("was unplugged; waiting for its return"), std::string::npos)
      << run.err;
  // OpenNI2 asks for threads that have ended, such as that of the recorder.
  const auto recorded = runProgram(
      folder,
      Arguments{"live", "--frames", "12", "--quiet", "--record", folder + "/walk.oni"} +
          kQuick);
  EXPECT_EQ(recorded.exit_code, 1);
  EXPECT_NE(recorded.err.find("the recording ends here; waiting"), std::string::npos)
      << recorded.err;
  const auto gone = runProgram(folder, Arguments{"live", "--no-reconnect"} + kQuick);
  EXPECT_EQ(gone.exit_code, 1);
  EXPECT_NE(gone.err.find("was unplugged\n"), std::string::npos) << gone.err;
}

TEST(LiveProgram, ListsCameras)
{
  const std::string folder = freshFolder("live_list");
  const Camera camera("devices 2");
  const auto run = runProgram(folder, {"live", "--list"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.out.find("1  "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("virtual://1"), std::string::npos) << run.out;
  const auto second =
      runProgram(folder, Arguments{"live", "--device", "2", "--frames", "1"} + kQuick);
  EXPECT_EQ(second.exit_code, 0) << second.err;
}

TEST(LiveProgram, ShowsAWindow)
{
  const std::string folder = freshFolder("live_view");
  ::unsetenv("DISPLAY");
  const auto blind = runProgram(folder, {"live", "--view", "--frames", "1"});
  EXPECT_EQ(blind.exit_code, 1);
  EXPECT_EQ(blind.errorLines(), 1) << blind.err;
  if (blind.err.find("there is no display") == std::string::npos)
    GTEST_SKIP() << blind.err;
  if (::access("/usr/bin/xvfb-run", X_OK) != 0)
    GTEST_SKIP() << "no xvfb-run: install xvfb";
  const auto run = test::runExecutable(
      folder,
      "/usr/bin/xvfb-run",
      Arguments{"-a", HOLDFAST_PROGRAM, "live", "--view", "--frames", "20"} + kQuick);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("20 frames in"), std::string::npos) << run.out;
}

/// One line on standard error, and the exit code.
void
expectError(int exit_code, const Arguments& arguments, const std::string& text)
{
  const auto run = runProgram(freshFolder("live_errors"), arguments);
  EXPECT_EQ(run.exit_code, exit_code);
  EXPECT_EQ(run.errorLines(), 1) << run.err;
  EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
  EXPECT_TRUE(run.out.empty()) << run.out;
}

TEST(LiveProgram, ErrorsAreOneLine)
{
  {
    const Camera camera("devices 0");
    for (const std::string command : {"live", "record"}) {
      expectError(1, {command, "-o", "x"}, "no depth camera");
      expectError(1, {command, "--list", "-o", "x"}, "no camera found");
    }
  }
  {
    const Camera camera("depth 0");
    expectError(1, {"live"}, "no depth sensor");
  }
  const std::string folder = freshFolder("live_error_files");
  test::writeFile(folder + "/text.oni", "no recording");
  expectError(1, {"live", "--device", folder + "/text.oni"}, "text.oni: ");
  expectError(1, {"live", "--device", folder + "/none.oni"}, "no such file");
  expectError(1, {"live", "--device", "3"}, "3");
  expectError(1, {"live", "--json-lines", folder}, "cannot be written");
  expectError(1, {"live", "--json-lines", "/dev/full"}, "cannot be written");
  expectError(1, {"live", "-o", folder + "/text.oni"}, "text.oni");
  expectError(1, {"record", "-o", folder + "/none/walk.oni"}, "walk.oni");
  expectError(2, {"record"}, "--output");
  expectError(2, {"live", "--budget-ms", "0"}, "--budget-ms");
  expectError(2, {"live", "--size", "1x1"}, "--size");
  expectError(2, {"live", "--frames", "0"}, "--frames");
  expectError(2, {"live", "--sensor", "no_such_sensor"}, "--sensor");
}

}} // namespace holdfast
