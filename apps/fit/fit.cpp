#include "commands.h"
#include "console.h"
#include "fit_settings.h"
#include "patch_output.h"
#include "summary.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/intrinsics.h>
#include <holdfast/pcl/patch_extraction.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  holdfast fit scene.pcd
      patches all over the cloud, as a table
  holdfast fit clouds/ -o results --radius 0.04 --spacing 0.02
      every cloud of a folder; NAME.patches.json, .pcd and .ply for each
  holdfast fit depth.png --depth-scale 5000 --intrinsics 525,525,319.5,239.5 --json -
      a depth image in units of 0.2 mm by a camera of 525 px, as TUM's are
  holdfast fit can.pcd --whole --surface cylinder --json -
      one cylinder to all points
  holdfast fit floor.pcd --surface plane --boundary rectangle --seeds 200 \
      --seed-strategy poisson --random-seed 7
      at most 200 planes bounded by rectangles

Covariances of the points come from the field 'covariance' of a PCD (six floats xx xy xz
yy yz zz, m^2), else from the sensor; the sensor's pose comes from VIEWPOINT. In the
table, sigma of the normal is its rms angle and sigma of the centre its rms distance from
where a cloud without noise would have put them. A cloud that yields no patch counts as
failed.
)";

/// Where the results go.
class Output {
public:
  explicit Output(const FitSettings& settings) : settings_(settings)
  {
    if (!settings.json_path.empty() && settings.json_path != "-")
      json_.emplace(settings.json_path);
    if (!settings.output_folder.empty())
      checkFolder(settings.output_folder);
  }

  void write(const PatchReport& report)
  {
    if (!settings_.output_folder.empty())
      writeFiles(report);
    if (settings_.json_path == "-")
      writeJson(std::cout, report, JsonLayout::OneLine);
    else if (!settings_.quiet)
      std::cout << summaryTable(report) << std::flush;
    if (json_) {
      writeJson(json_->stream(), report, JsonLayout::OneLine);
      has_json_ = true;
    }
  }

  /// The JSON file appears only if a cloud has got into it.
  void finish()
  {
    if (has_json_)
      json_->commit();
  }

private:
  void writeFiles(const PatchReport& report)
  {
    const std::string stem = fs::path(report.cloud).stem().string();
    const auto [owner, is_new] = written_.emplace(stem, report.cloud);
    if (!is_new)
      throw std::runtime_error(fmt::format("{}: its results would replace those of {}",
                                           report.cloud,
                                           owner->second));
    writePatchFiles(report, settings_.output_folder, stem);
  }

  const FitSettings& settings_;
  std::optional<AtomicFile> json_;
  bool has_json_ = false;
  std::map<std::string, std::string> written_; ///< cloud by the name of its results
};

/// \return true when every covariance of the cloud was one.
bool
checkCovariances(const PatchReport& report)
{
  const PointAccounting& points = report.result.points;
  if (points.invalid_covariance == 0)
    return true;
  const std::string what = fmt::format(
      "{}: {} of {} covariances are not finite or not positive semi-definite",
      report.cloud,
      points.invalid_covariance,
      points.valid());
  if (points.used == 0)
    throw std::runtime_error(what);
  printError(what + "; those points are left out");
  return false;
}

void
checkPatches(const PatchReport& report)
{
  if (!report.result.patches.empty())
    return;
  const std::string rejected = rejectedText(report.result);
  throw std::runtime_error(fmt::format("{}: no patch: {}",
                                       report.cloud,
                                       rejected.empty() ? "no seed" : rejected));
}

void
printNotices(const std::string& path, const std::vector<std::string>& notices)
{
  for (const std::string& notice : notices)
    printNotice(path + ": " + notice);
}

ExtractionResult
extract(const RangeCloud& cloud, const Sensor& sensor, const FitSettings& settings)
{
  ProgressBar bar("fitting", !settings.quiet);
  ExtractionOptions options = settings.extraction.options;
  options.progress = [&bar](int done, int total) { bar.update(done, total); };
  return settings.whole ? extractWhole(cloud, sensor, options) :
                          extractPatches(cloud, sensor, options);
}

/// The cloud of a file with the sensor that took it, and what had to be decided.
struct Input {
  RangeCloud cloud;
  CloudFileInfo file;
  Sensor sensor;
  std::vector<std::string> notices;
};

Input
loadInput(const std::string& path, const Sensor& nominal, const FitSettings& settings)
{
  Input input;
  input.cloud = loadCloud(path, loadOptions(settings.input, nominal), &input.file);
  input.notices = inputNotices(settings.input, input.file);
  std::string notice;
  input.sensor = matchedSensor(sensorOf(input.file, nominal), input.cloud, &notice);
  if (!notice.empty())
    input.notices.push_back(notice);
  if (settings.sigma_m > 0.0)
    input.sensor = withConstantNoise(input.sensor, settings.sigma_m);
  input.cloud = withoutPatternMap(path, input.cloud, input.sensor, input.notices);
  return input;
}

/// The road from a file to its patches.
/// \return false when the results are written but some covariances of the cloud are
/// none.
bool
fitCloud(const std::string& path,
         const Sensor& nominal,
         const FitSettings& settings,
         Output& output)
{
  PatchReport report;
  report.cloud = path;
  report.options = settings.extraction.options;
  report.whole = settings.whole;

  const Stopwatch loading;
  const Input input = loadInput(path, nominal, settings);
  report.file = input.file;
  report.sensor_pose = input.cloud.sensor_pose;
  report.offset = input.cloud.offset;
  report.covariances_of_cloud = input.cloud.hasCovariances();
  report.load_ms = loading.milliseconds();

  const Stopwatch fitting;
  report.result = extract(input.cloud, input.sensor, settings);
  report.fit_ms = fitting.milliseconds();
  std::vector<std::string>& notices = report.result.notices;
  notices.insert(notices.begin(), input.notices.begin(), input.notices.end());

  if (!settings.quiet)
    printNotices(path, notices);
  const bool clean = checkCovariances(report);
  checkPatches(report);
  output.write(report);
  return clean;
}

int
runFit(const CLI::App& command, FitSettings& settings)
{
  finishExtractionOptions(command, settings.extraction);
  const Sensor named = loadSensorOption(settings.input.sensor_name);
  const Sensor sensor = settings.no_pattern ? withoutPattern(named) : named;
  Output output(settings);
  const int exit_code =
      forEachCloud(settings.input.clouds, [&](const std::string& path) {
        return fitCloud(path, sensor, settings, output);
      });
  output.finish();
  return exit_code;
}

} // namespace

void
addFitCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("fit", "Fit bounded patches with covariance to clouds");
  command->footer(kExamples);
  const auto settings = std::make_shared<FitSettings>();
  addFitOptions(*command, *settings);
  command->callback(
      [command, settings, &exit_code] { exit_code = runFit(*command, *settings); });
}

} // namespace holdfast::app
