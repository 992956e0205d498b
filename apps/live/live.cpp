#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "device_options.h"
#include "extraction_options.h"
#include "grabber_run.h"
#include "input_options.h"
#include "live_statistics.h"
#include "map/map_output.h"
#include "patch_output.h"
#include "patch_view.h"
#include "recording.h"

#include <holdfast/pcl/frame_extraction.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/pcl/pattern_subtraction.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace holdfast::app {
namespace {

constexpr const char* kExamples = R"(Examples:
  holdfast live
      patches of the first camera, with a line that says how fast
  holdfast live --max-patches 100 --budget-ms 10 --surface plane --json -
      at most 100 planes a frame, for another program: one line of JSON per frame
  holdfast live --view
      the same in a window
  holdfast live --record walk.oni -o walk
      keeps what the camera saw, and the patches of every frame
  holdfast live --device walk.oni --every-frame -o walk
      the same patches, and those of all frames, from the recording
  holdfast live --device walk.oni --every-frame --map walk.json
      what the frames say together, fused (doc/maps.md)

Newer frames replace those that wait, so that patches are always of the latest view;
frames lost that way are counted as dropped. Seeds whose patch was good in the frame
before have their turn first, so that patches stay while the scene does. Latency runs
from the arrival of a frame at this computer to its patches.
)";

constexpr int kDefaultPatches = 300;
constexpr double kDefaultBudgetMs = 25.0;

struct LiveSettings {
  Openni2Options device;
  std::string sensor_name = "kinect_v1";
  bool no_pattern = false;
  ExtractionSettings extraction;
  double budget_ms = kDefaultBudgetMs;
  RunOptions run;
  std::string record_path;
  std::string json_path; ///< empty: none; "-": standard output
  std::string output_folder; ///< empty: none
  std::vector<std::string> map_files; ///< empty: no map is kept
  bool view = false;
};

/// One line of JSON per frame, for programs that wait for it.
class JsonLines {
public:
  explicit JsonLines(const std::string& path)
  : path_(path == "-" ? "standard output" : path)
  {
    if (path != "-") {
      file_.open(path);
      check(file_);
    }
  }

  void write(const PatchReport& report)
  {
    std::ostream& out = file_.is_open() ? file_ : std::cout;
    writeJson(out, report, JsonLayout::OneLine);
    check(out.flush());
  }

private:
  void check(const std::ostream& out) const
  {
    if (!out)
      throw std::runtime_error(path_ + ": cannot be written");
  }

  std::string path_;
  std::ofstream file_;
};

/// From frames to patches, and to where they are wanted.
class LiveSession {
public:
  LiveSession(const LiveSettings& settings, Openni2Grabber& grabber);

  /// On the grabber's thread.
  void process(const RangeFrame::ConstPtr& frame);

  void finish();

  /// "3 dropped", and what the disk was too slow for.
  std::string droppedText() const;

  const LiveStatistics& statistics() const
  {
    return statistics_;
  }

  /// On the main thread. \return false when the user has closed the window.
  bool onIdle()
  {
    if (recording_)
      recording_->checkDisk();
    return !view_ || view_->update();
  }

private:
  void write(const RangeFrame& frame);
  ExtractionResult extract(const RangeCloud& cloud);

  const LiveSettings& settings_;
  Openni2Grabber& grabber_;
  Sensor sensor_;
  FrameExtractor extractor_;
  std::optional<FrameMapper> mapper_;
  MapSource map_source_;
  int lost_frames_ = 0; ///< whose pose in the map was not found
  std::optional<Recording> recording_;
  std::optional<JsonLines> json_;
  std::optional<PatchView> view_;
  LiveStatistics statistics_;
  PatchReport report_; ///< of the last frame; its memory is used again
};

Sensor
sensorOf(const LiveSettings& settings)
{
  const Sensor sensor = loadSensorOption(settings.sensor_name);
  return settings.no_pattern ? withoutPattern(sensor) : sensor;
}

LiveSession::LiveSession(const LiveSettings& settings, Openni2Grabber& grabber)
: settings_(settings)
, grabber_(grabber)
, sensor_(withCamera(sensorOf(settings), grabber.camera()))
, extractor_(sensor_, settings.extraction.options)
{
  const Camera& camera = sensor_.camera;
  if (const std::string error = patternMapError(sensor_, camera.width, camera.height);
      !error.empty())
    throw std::runtime_error("frames of " + error);
  if (!settings.output_folder.empty())
    makeFrameFolder(settings.output_folder);
  if (!settings.map_files.empty()) {
    mapper_.emplace(sensor_, mappingOptionsFor(sensor_, settings.extraction.options));
    map_source_.sensor = sensor_;
    map_source_.options = settings.extraction.options;
  }
  if (settings.view)
    view_.emplace();
  if (!settings.json_path.empty())
    json_.emplace(settings.json_path);
  if (!settings.record_path.empty())
    recording_.emplace(grabber, settings.record_path, settings.device.playback);
}

ExtractionResult
LiveSession::extract(const RangeCloud& cloud)
{
  if (!mapper_)
    return extractor_.extract(cloud, std::move(report_.result));
  FrameReport former;
  former.extraction = std::move(report_.result);
  FrameReport report = mapper_->addUnknown(cloud, std::move(former));
  if (report.registration &&
      report.registration->status != RegistrationStatus::Converged)
    ++lost_frames_;
  map_source_.addFrame(report.extraction);
  return std::move(report.extraction);
}

void
LiveSession::finish()
{
  if (recording_)
    recording_->finish();
  if (!mapper_)
    return;
  const PatchMap& map = mapper_->map();
  if (map.patches().empty())
    throw std::runtime_error("no patch in any frame: no map is written");
  map_source_.name = fmt::format("map of {} frames", map.frames());
  writeMap(map,
           map_source_,
           fitsOf(map, settings_.extraction.options.fit),
           {settings_.map_files, ""});
  if (!settings_.run.quiet && lost_frames_ > 0)
    printNotice(fmt::format("{} frames are not in the map: their pose was not found",
                            lost_frames_));
}

void
LiveSession::process(const RangeFrame::ConstPtr& frame)
{
  if (recording_)
    recording_->push(frame);
  const Stopwatch watch;
  report_.result = extract(subtractPatternMap(frame->cloud, sensor_));
  report_.fit_ms = watch.milliseconds();
  statistics_.addFrame(frame->received, report_.result.patches);
  if (view_)
    view_->put(frame, report_.result.patches);
  write(*frame);
}

void
LiveSession::write(const RangeFrame& frame)
{
  report_.cloud = frameName(statistics_.frames());
  report_.timestamp_us = frame.timestamp_us;
  report_.options = settings_.extraction.options;
  if (json_)
    json_->write(report_);
  if (!settings_.output_folder.empty() && !report_.result.patches.empty())
    writePatchFiles(report_, settings_.output_folder, report_.cloud);
}

std::string
LiveSession::droppedText() const
{
  std::string text = fmt::format("{} dropped", grabber_.statistics().dropped);
  if (const std::uint64_t lost = recording_ ? recording_->dropped() : 0; lost > 0)
    text += fmt::format(", {} more not recorded", lost);
  return text;
}

int
runLive(const CLI::App& command, LiveSettings& settings)
{
  finishExtractionOptions(command, settings.extraction);
  settings.extraction.options.sampler.max_time_s = 1e-3 * settings.budget_ms;
  settings.run.reconnects = settings.device.reconnect;
  if (settings.view)
    settings.run.idle_period = std::chrono::milliseconds(15);
  settings.run.records_oni = isOniPath(settings.record_path);
  settings.device.color = settings.view || settings.run.records_oni;
  Openni2Grabber grabber(settings.device);
  LiveSession session(settings, grabber);
  RunCallbacks callbacks;
  callbacks.frame = [&session](const auto& frame) { session.process(frame); };
  callbacks.status = [&session] {
    return fmt::format("{}, {}, {}",
                       session.statistics().pace(),
                       session.statistics().work(),
                       session.droppedText());
  };
  callbacks.idle = [&session] { return session.onIdle(); };
  const int exit_code = runGrabber(grabber, settings.run, callbacks);
  session.finish();
  if (!settings.run.quiet)
    (settings.json_path == "-" ? std::cerr : std::cout)
        << session.statistics().summary(session.droppedText());
  return exit_code;
}

void
addOutputOptions(CLI::App& command, LiveSettings& settings)
{
  command
      .add_option("--record",
                  settings.record_path,
                  "Record the camera: an .oni file, or a folder for a PCD per frame")
      ->type_name("FILE.oni|DIR")
      ->group("Output");
  addJsonOption(command,
                settings.json_path,
                "one object per frame, each on a line of its own",
                "--json-lines");
  command
      .add_option("-o,--output",
                  settings.output_folder,
                  "Write the patches of each frame that has any as "
                  "frame_000001.patches.json, .pcd and .ply here")
      ->type_name("DIR")
      ->group("Output");
  command
      .add_option("--map",
                  settings.map_files,
                  "Keep a map of the patches, whose frames find their own poses, and "
                  "write it at the end: FILE.json or FILE.map, as 'holdfast map' does")
      ->check(CLI::Validator(
          [](std::string& path) {
            return isMapOutput(path) ? "" : path + " is neither *.json nor *.map";
          },
          ""))
      ->type_name("FILE")
      ->group("Output");
  command
      .add_flag("--view",
                settings.view,
                "Show points and patches in a window, coloured by the uncertainty of "
                "their normals")
      ->group("Output");
}

void
addLiveOptions(CLI::App& command, LiveSettings& settings)
{
  addDeviceOptions(command, settings.device);
  addSensorOption(command, settings.sensor_name);
  addNoPatternOption(command, settings.no_pattern);
  addExtractionOptions(command, settings.extraction);
  SamplerOptions& sampler = settings.extraction.options.sampler;
  sampler.max_patches = kDefaultPatches;
  command.get_option("--max-patches")->default_str(std::to_string(kDefaultPatches));
  command
      .add_option("--seeds",
                  sampler.max_seeds,
                  "Most seeds a frame; default: three for every patch")
      ->check(CLI::Range(1, 100000000, "N"))
      ->type_name("")
      ->group("Seeds and neighbourhoods");
  command
      .add_option("--budget-ms",
                  settings.budget_ms,
                  "Start no new patch when a frame has taken so long, milliseconds")
      ->check(positiveNumber("MS"))
      ->type_name("")
      ->capture_default_str()
      ->group("Seeds and neighbourhoods");
  addRunOptions(command, settings.run);
  addOutputOptions(command, settings);
  tidyHelp(command);
}

} // namespace

void
addLiveCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("live", "Fit patches to a depth camera's frames as they come");
  command->footer(kExamples);
  const auto settings = std::make_shared<LiveSettings>();
  addLiveOptions(*command, *settings);
  command->callback(
      [command, settings, &exit_code] { exit_code = runLive(*command, *settings); });
}

} // namespace holdfast::app
