#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "input_options.h"
#include "noise_report.h"

#ifdef HOLDFAST_HAVE_OPENNI2
#include "live/capture.h"
#endif

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/pattern_map_file.h>
#include <holdfast/pcl/intrinsics.h>
#include <holdfast/version.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

namespace holdfast::app {
namespace {

constexpr const char* kHelp =
    R"(Put the camera on a tripod before a wall, a table or the floor, with other things in
the picture if you like, and record some frames without touching anything. One frame
tells how far the disparities of a plane scatter; several tell how much of that changes
with time and how much is a fixed pattern of the camera, which no averaging removes.
What neighbouring pixels share of their error, waves of some length over the image, is
measured on planes and written as the sensor's `pattern`. The shape of the surfaces is
part of it, unless frames from other places, --pose, tell them apart: the pattern stays
with the pixels, and --map takes it down pixel by pixel, to be subtracted. Planes
should fill most of the picture.

Examples:
  holdfast calibrate --device 1                          how large is the noise?
  holdfast calibrate frame*.pcd                          the same from files
  holdfast calibrate frames/ --sensor xtion -o mine.yaml
  holdfast fit cloud.pcd --sensor mine.yaml              and now use it
  holdfast calibrate frames/ --plot noise.svg --json noise.json
  holdfast calibrate first/ --pose second/ --pose third/ -o mine.yaml
  holdfast calibrate first/ --pose second/ --map mine.png -o mine.yaml
)";

struct CalibrateSettings {
  InputOptions input; ///< with the frames of the first pose
  std::vector<std::vector<std::string>> other_poses;
#ifdef HOLDFAST_HAVE_OPENNI2
  Openni2Options device;
  int frames = 30;
#endif
  int region_px = 0;
  std::string sensor_path; ///< empty: none
  std::string map_path; ///< empty: none
  std::string plot_path; ///< empty: none
  std::string json_path; ///< empty: none; "-": standard output
  bool quiet = false; ///< errors only
};

std::string
sizeText(const RangeCloud& cloud)
{
  return fmt::format("{} x {}", cloud.points->width, cloud.points->height);
}

/// Intrinsics recovered from points of one camera agree by much more.
bool
isSameCamera(const Camera& a, const Camera& b)
{
  constexpr double kFocalRatio = 0.02, kMiddlePx = 8.0;
  return std::abs(a.fx / b.fx - 1.0) < kFocalRatio &&
         std::abs(a.fy / b.fy - 1.0) < kFocalRatio &&
         std::abs(a.cx - b.cx) < kMiddlePx && std::abs(a.cy - b.cy) < kMiddlePx;
}

/// The frames of all poses, all organized, of one size and one camera, in the order
/// given.
class Recording {
public:
  explicit Recording(const Sensor& nominal) : nominal_(nominal) {}

  void beginPose()
  {
    poses_.emplace_back();
    paths_.emplace_back();
  }

  void add(const std::string& path, RangeCloud cloud)
  {
    if (cloud.points->height < 2)
      throw std::runtime_error(path + ": not organized, the pixels of its points are "
                                      "lost");
    if (poses_.front().empty())
      sensor_ = matchedSensor(nominal_, cloud, &notice_);
    else
      requireSameAsFirst(path, cloud);
    paths_.back().push_back(path);
    poses_.back().push_back(std::move(cloud));
  }

  const std::vector<std::vector<RangeCloud>>& poses() const
  {
    return poses_;
  }

  /// That of the frames.
  const Sensor& sensor() const
  {
    return sensor_;
  }

  /// Of the sensor, for the user; may be empty.
  std::string notice() const
  {
    return notice_.empty() ? "" : paths_.front().front() + ": " + notice_;
  }

  std::string name(std::size_t pose) const
  {
    const std::size_t others = paths_[pose].size() - 1;
    const std::string& first = paths_[pose].front();
    return others == 0 ? first : fmt::format("{} and {} more", first, others);
  }

private:
  void requireSameAsFirst(const std::string& path, const RangeCloud& cloud) const
  {
    const RangeCloud& first = poses_.front().front();
    const std::string& first_path = paths_.front().front();
    if (sizeText(cloud) != sizeText(first))
      throw std::runtime_error(fmt::format("{}: {} pixels, where {} has {}",
                                           path,
                                           sizeText(cloud),
                                           first_path,
                                           sizeText(first)));
    const Camera other = matchedSensor(nominal_, cloud).camera;
    if (!isSameCamera(other, sensor_.camera))
      throw std::runtime_error(
          fmt::format("{}: taken by another camera, with a focal length of {:.1f} px "
                      "about column {:.1f}, where {} has {:.1f} px about {:.1f}",
                      path,
                      other.fx,
                      other.cx,
                      first_path,
                      sensor_.camera.fx,
                      sensor_.camera.cx));
  }

  Sensor nominal_;
  Sensor sensor_;
  std::string notice_;
  std::vector<std::vector<std::string>> paths_; ///< by pose
  std::vector<std::vector<RangeCloud>> poses_;
};

/// All frames, or nothing when one of them cannot be used, which has been said then.
std::optional<Recording>
loadRecording(const CalibrateSettings& settings, const Sensor& nominal)
{
  std::vector<std::vector<std::string>> poses = settings.other_poses;
  poses.insert(poses.begin(), settings.input.clouds);
  Recording recording(nominal);
  for (const std::vector<std::string>& paths : poses) {
    recording.beginPose();
    const int exit_code = forEachCloud(paths, [&](const std::string& path) {
      CloudFileInfo info;
      RangeCloud cloud = loadCloud(path, loadOptions(settings.input, nominal), &info);
      if (!settings.quiet)
        for (const std::string& notice : inputNotices(settings.input, info))
          printNotice(path + ": " + notice);
      recording.add(path, std::move(cloud));
      return true;
    });
    // Without a frame that was meant to be there, the result would be another one.
    if (exit_code != 0)
      return std::nullopt;
  }
  return recording;
}

NoiseReport
calibrate(const Recording& recording, const CalibrateSettings& settings)
{
  NoiseReport report = measureNoise(
      recording.poses(),
      recording.sensor(),
      settings.region_px,
      [&](int pose) { return recording.name(static_cast<std::size_t>(pose)); });
  if (!settings.map_path.empty())
    measurePatternMap(recording.poses(), report);
  if (!recording.notice().empty() && !settings.quiet)
    printNotice(recording.notice());
  return report;
}

#ifdef HOLDFAST_HAVE_OPENNI2
NoiseReport
calibrateCamera(const CalibrateSettings& settings, Sensor sensor)
{
  const std::vector<RangeCloud> frames =
      captureFrames(settings.device, settings.frames, settings.quiet, sensor.camera);
  return measureNoise({frames}, sensor, settings.region_px, [](int) {
    return std::string("the camera");
  });
}

void
addCameraOptions(CLI::App& command, CalibrateSettings& settings)
{
  addDeviceOptions(command, settings.device);
  for (const char* meaningless : {"--every-frame", "--no-reconnect"})
    command.remove_option(command.get_option(meaningless));
  command.add_option("--frames", settings.frames, "Take so many frames of the camera")
      ->check(CLI::Range(1, 1000, "N"))
      ->type_name("")
      ->capture_default_str()
      ->group("Camera");
  // One or the other: a camera is asked for by its option, be it the first.
  command.get_option("--device")->excludes("CLOUD")->excludes("--pose");
  command.get_option("CLOUD")->required(false);
}
#endif

/// Nothing when a frame cannot be used, which has been said then.
std::optional<NoiseReport>
measure(const CalibrateSettings& settings, const Sensor& nominal)
{
#ifdef HOLDFAST_HAVE_OPENNI2
  if (!settings.device.device.empty())
    return calibrateCamera(settings, nominal);
  if (settings.input.clouds.empty())
    throw CLI::RequiredError("CLOUD or --device");
#endif
  const std::optional<Recording> recording = loadRecording(settings, nominal);
  if (!recording)
    return std::nullopt;
  return calibrate(*recording, settings);
}

int
runCalibrate(const CalibrateSettings& settings)
{
  const Sensor nominal = loadSensorOption(settings.input.sensor_name);
  // Outputs that cannot be written are known before the work.
  std::optional<AtomicFile> json, plot;
  if (!settings.json_path.empty() && settings.json_path != "-")
    json.emplace(settings.json_path);
  if (!settings.plot_path.empty())
    plot.emplace(settings.plot_path);
  const std::optional<NoiseReport> found = measure(settings, nominal);
  if (!found)
    return 1;
  const NoiseReport& report = *found;
  if (report.hasMap())
    savePatternMap(settings.map_path, *report.map.map);
  if (!settings.sensor_path.empty())
    saveCalibratedSensor(settings.sensor_path, report, settings.map_path);
  if (settings.json_path == "-")
    std::cout << noiseReportJson(report).dump(2) << std::endl;
  else if (!settings.quiet)
    std::cout << noiseReportText(report) << std::flush;
  if (json) {
    json->stream() << noiseReportJson(report).dump(2) << '\n';
    json->commit();
  }
  if (plot) {
    writeSvg(plot->stream(),
             noiseReportPlot(report),
             "holdfast " HOLDFAST_VERSION " calibrate, sensor " + report.sensor.name);
    plot->commit();
  }
  return 0;
}

std::string
requireSvg(const std::string& path)
{
  return std::filesystem::path(path).extension() == ".svg" ?
             "" :
             path + ": the plot is written as SVG; name it *.svg";
}

std::string
requirePng(const std::string& path)
{
  return std::filesystem::path(path).extension() == ".png" ?
             "" :
             path + ": the map is written as PNG; name it *.png";
}

std::string
requireRegion(const std::string& text)
{
  const auto size = parseNumber<int>(text);
  return size && *size >= 8 && *size % 8 == 0 ? "" : text + " is not a multiple of 8";
}

void
addOutputOptions(CLI::App& command, CalibrateSettings& settings)
{
  const std::string group = "Output";
  command
      .add_option("-o,--output",
                  settings.sensor_path,
                  "Write a sensor file with the measured noise, for --sensor")
      ->type_name("SENSOR.yaml")
      ->group(group);
  command
      .add_option("--map",
                  settings.map_path,
                  "Make a map of the fixed pattern from all poses, a 16-bit PNG that "
                  "the sensor file names and fit, live and info subtract; the pattern "
                  "is what is left then")
      ->check(CLI::Validator(requirePng, "FILE.png"))
      ->type_name("")
      ->needs("--pose")
      ->group(group);
  command
      .add_option("--plot",
                  settings.plot_path,
                  "Draw the noise over the depth, and what pixels share over "
                  "their distance")
      ->check(CLI::Validator(requireSvg, "FILE.svg"))
      ->type_name("")
      ->group(group);
  addJsonOption(command, settings.json_path);
  addQuietOption(command, settings.quiet);
}

} // namespace

void
addCalibrateCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("calibrate", "Measure the noise of a depth camera at rest");
  command->footer(kHelp);
  const auto settings = std::make_shared<CalibrateSettings>();
  addInputOptions(*command, settings->input);
  command
      ->add_option("--pose",
                   settings->other_poses,
                   "Frames of another scene or from another place, as CLOUD; once for "
                   "each pose")
      ->type_name("CLOUD")
      ->group("Input");
#ifdef HOLDFAST_HAVE_OPENNI2
  addCameraOptions(*command, *settings);
#endif
  command
      ->add_option("--region",
                   settings->region_px,
                   "Fit planes to squares of this many pixels, such as the patches you "
                   "will fit, instead of whole planes")
      ->check(CLI::Validator(requireRegion, "PX"))
      ->type_name("")
      ->group("Input");
  addOutputOptions(*command, *settings);
  tidyHelp(*command);
  command->callback([settings, &exit_code] { exit_code = runCalibrate(*settings); });
}

} // namespace holdfast::app
