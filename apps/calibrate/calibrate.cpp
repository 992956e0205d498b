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
#include <holdfast/pcl/intrinsics.h>
#include <holdfast/version.h>

#include <CLI/CLI.hpp>

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

Examples:
  holdfast calibrate --device 1                          how large is the noise?
  holdfast calibrate frame*.pcd                          the same from files
  holdfast calibrate frames/ --sensor xtion -o mine.yaml
  holdfast fit cloud.pcd --sensor mine.yaml              and now use it
  holdfast calibrate frames/ --plot noise.svg --json noise.json
)";

struct CalibrateSettings {
  InputOptions input;
#ifdef HOLDFAST_HAVE_OPENNI2
  Openni2Options device;
  int frames = 30;
#endif
  int region_px = 0;
  std::string sensor_path; ///< empty: none
  std::string plot_path; ///< empty: none
  std::string json_path; ///< empty: none; "-": standard output
  bool quiet = false; ///< errors only
};

std::string
sizeText(const RangeCloud& cloud)
{
  return std::to_string(cloud.points->width) + " x " +
         std::to_string(cloud.points->height);
}

/// The frames, all organized and of one size, in the order given.
struct Recording {
  std::vector<std::string> paths;
  std::vector<RangeCloud> clouds;

  void add(const std::string& path, RangeCloud cloud)
  {
    if (cloud.points->height < 2)
      throw std::runtime_error(path + ": not organized, the pixels of its points are "
                                      "lost");
    if (!clouds.empty() && sizeText(cloud) != sizeText(clouds.front()))
      throw std::runtime_error(path + ": " + sizeText(cloud) + " pixels, where " +
                               paths.front() + " has " + sizeText(clouds.front()));
    paths.push_back(path);
    clouds.push_back(std::move(cloud));
  }

  std::string name() const
  {
    const std::size_t others = paths.size() - 1;
    return others == 0 ? paths.front() :
                         paths.front() + " and " + std::to_string(others) + " more";
  }
};

/// All frames, or nothing when one of them cannot be used, which has been said then.
std::optional<Recording>
loadRecording(const InputOptions& input, const Sensor& sensor, bool quiet)
{
  Recording recording;
  const int exit_code = forEachCloud(input.clouds, [&](const std::string& path) {
    CloudFileInfo info;
    RangeCloud cloud = loadCloud(path, loadOptions(input, sensor), &info);
    if (!quiet)
      for (const std::string& notice : inputNotices(input, info))
        printNotice(path + ": " + notice);
    recording.add(path, std::move(cloud));
    return true;
  });
  // Without a frame that was meant to be there, the result would be another one.
  return exit_code == 0 ? std::optional(recording) : std::nullopt;
}

NoiseReport
calibrate(const Recording& recording,
          const Sensor& nominal,
          const CalibrateSettings& settings)
{
  std::string notice;
  const Sensor sensor = matchedSensor(nominal, recording.clouds.front(), &notice);
  try {
    const NoiseReport report =
        measureNoise(recording.clouds, sensor, settings.region_px);
    if (!notice.empty() && !settings.quiet)
      printNotice(recording.paths.front() + ": " + notice);
    return report;
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(recording.name() + ": " + error.what());
  }
}

#ifdef HOLDFAST_HAVE_OPENNI2
NoiseReport
calibrateCamera(const CalibrateSettings& settings, Sensor sensor)
{
  const std::vector<RangeCloud> frames =
      captureFrames(settings.device, settings.frames, settings.quiet, sensor.camera);
  return measureNoise(frames, sensor, settings.region_px);
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
  command.get_option("--device")->excludes("CLOUD");
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
  const std::optional<Recording> recording =
      loadRecording(settings.input, nominal, settings.quiet);
  if (!recording)
    return std::nullopt;
  return calibrate(*recording, nominal, settings);
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
  if (!settings.sensor_path.empty())
    saveCalibratedSensor(settings.sensor_path, report);
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
  command.add_option("--plot", settings.plot_path, "Draw the noise over the depth")
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
