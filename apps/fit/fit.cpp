#include "batch.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "dense_output.h"
#include "fingerprint.h"
#include "fit_settings.h"
#include "patch_output.h"
#include "summary.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/intrinsics.h>
#include <holdfast/pcl/patch_extraction.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <algorithm>
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
  holdfast fit depth.png --dense 4 -o results
      a patch at every fourth pixel, as an organized cloud and as images
  holdfast fit --manifest clouds.txt --shard 3/16 --resume -o results
      the third of sixteen parts of a data set, as far as it is not done yet

Covariances of the points come from the field 'covariance' of a PCD (six floats xx xy xz
yy yz zz, m^2), else from the sensor; the sensor's pose comes from VIEWPOINT. In the
table, sigma of the normal is its rms angle and sigma of the centre its rms distance from
where a cloud without noise would have put them. A cloud that yields no patch counts as
failed.

With --manifest, each cloud leaves either its results or NAME.failed.json with the
reason. Exit codes there: 0 all done, 2 finished with clouds that failed, 1 wrong usage
or an error of reading the list or of writing.
)";

/// Where the results go.
class Output {
public:
  explicit Output(const FitSettings& settings) : settings_(settings)
  {
    if (!settings.json_path.empty() && settings.json_path != "-") {
      requireNoInput(settings.json_path, settings.input.clouds);
      json_.emplace(settings.json_path);
    }
    if (!settings.output_folder.empty())
      checkFolder(settings.output_folder);
  }

  void write(const PatchReport& report)
  {
    if (!settings_.output_folder.empty())
      writePatchFiles(report, settings_.output_folder, newStem(report.cloud));
    if (settings_.json_path == "-")
      writeJson(std::cout, report, JsonLayout::OneLine);
    else if (!settings_.quiet)
      std::cout << summaryTable(report) << std::flush;
    if (json_) {
      writeJson(json_->stream(), report, JsonLayout::OneLine);
      has_json_ = true;
    }
  }

  void write(const DenseReport& report, double load_ms, double fit_ms)
  {
    if (!settings_.output_folder.empty())
      writeDenseFiles(report, settings_.output_folder, newStem(report.cloud));
    if (!settings_.quiet)
      std::cout << denseSummary(report, load_ms, fit_ms) << std::flush;
  }

  /// The JSON file appears only if a cloud has got into it.
  void finish()
  {
    if (has_json_)
      json_->commit();
  }

private:
  /// The name of a cloud's results.
  std::string newStem(const std::string& cloud)
  {
    const std::string stem = fs::path(cloud).stem().string();
    const auto [owner, is_new] = written_.emplace(stem, cloud);
    if (!is_new)
      throw std::runtime_error(fmt::format("{}: its results would replace those of {}",
                                           cloud,
                                           owner->second));
    return stem;
  }

  const FitSettings& settings_;
  std::optional<AtomicFile> json_;
  bool has_json_ = false;
  std::map<std::string, std::string> written_; ///< cloud by the name of its results
};

/// \return true when every covariance of the cloud was one.
bool
checkCovariances(const std::string& cloud, const PointAccounting& points)
{
  if (points.invalid_covariance == 0)
    return true;
  const std::string what = fmt::format(
      "{}: {} of {} covariances are not finite or not positive semi-definite",
      cloud,
      points.invalid_covariance,
      points.valid());
  if (points.used == 0)
    throw std::runtime_error(what);
  printError(what + "; those points are left out");
  return false;
}

[[noreturn]] void
failWithoutPatches(const std::string& cloud, const ExtractionResult& result)
{
  const std::string rejected = rejectedText(result);
  throw std::runtime_error(
      fmt::format("{}: no patch: {}", cloud, rejected.empty() ? "no seed" : rejected));
}

void
printNotices(const std::string& path, const std::vector<std::string>& notices)
{
  for (const std::string& notice : notices)
    printNotice(path + ": " + notice);
}

/// Calls run() with the options, and shows how far it has come.
template <typename Run>
auto
withProgress(const FitSettings& settings, Run&& run)
{
  ProgressBar bar("fitting", !settings.quiet && settings.manifest.empty());
  ExtractionOptions options = settings.extraction.options;
  options.progress = [&bar](int done, int total) { bar.update(done, total); };
  return run(options);
}

ExtractionResult
extract(const RangeCloud& cloud, const Sensor& sensor, const FitSettings& settings)
{
  return withProgress(settings, [&](const ExtractionOptions& options) {
    return settings.whole ? extractWhole(cloud, sensor, options) :
                            extractPatches(cloud, sensor, options);
  });
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

/// From a cloud to an image of patches. \return as fitCloud().
bool
fitDense(const std::string& path,
         const Input& input,
         double load_ms,
         const FitSettings& settings,
         Output& output)
{
  const ExtractionOptions& wanted = settings.extraction.options;
  if (const std::string error =
          validityError(input.cloud, wanted, settings.dense_stride);
      !error.empty())
    throw std::runtime_error(path + ": " + error);
  DenseReport report{path, input.cloud.sensor_pose, input.cloud.offset, {}};
  const Stopwatch fitting;
  report.dense = withProgress(settings, [&](const ExtractionOptions& options) {
    return extractDense(input.cloud, input.sensor, options, settings.dense_stride);
  });
  const double fit_ms = fitting.milliseconds();
  const ExtractionResult& result = report.dense.result;
  if (!settings.quiet) {
    printNotices(path, input.notices);
    printNotices(path, result.notices);
  }
  const bool clean = checkCovariances(path, result.points);
  if (std::none_of(result.patches.begin(), result.patches.end(), isAccepted))
    failWithoutPatches(path, result);
  output.write(report, load_ms, fit_ms);
  return clean;
}

/// A report of the cloud, with everything but the patches.
PatchReport
reportOf(const std::string& path, const Input& input, const FitSettings& settings)
{
  PatchReport report;
  report.cloud = path;
  report.fingerprint = settings.fingerprint;
  report.options = settings.extraction.options;
  report.whole = settings.whole;
  report.file = input.file;
  report.sensor_pose = input.cloud.sensor_pose;
  report.offset = input.cloud.offset;
  report.covariances_of_cloud = input.cloud.hasCovariances();
  return report;
}

/// Fits the cloud of a file. \param clean false when some covariances are none.
/// \throw std::runtime_error when there is no patch.
PatchReport
fitReport(const std::string& path,
          const Input& input,
          double load_ms,
          const FitSettings& settings,
          bool& clean)
{
  PatchReport report = reportOf(path, input, settings);
  report.load_ms = load_ms;
  const Stopwatch fitting;
  report.result = extract(input.cloud, input.sensor, settings);
  report.fit_ms = fitting.milliseconds();
  std::vector<std::string>& notices = report.result.notices;
  notices.insert(notices.begin(), input.notices.begin(), input.notices.end());
  if (const auto notice =
          assumedViewpoint(input.cloud, report.result.viewpoint_is_credible);
      notice && report.options.normal_side == NormalSide::Viewpoint)
    notices.push_back(*notice);
  if (!settings.quiet && settings.manifest.empty())
    printNotices(path, notices);
  clean = checkCovariances(path, report.result.points);
  if (report.result.patches.empty())
    failWithoutPatches(path, report.result);
  return report;
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
  const Stopwatch loading;
  const Input input = loadInput(path, nominal, settings);
  const double load_ms = loading.milliseconds();
  if (settings.dense_stride > 0)
    return fitDense(path, input, load_ms, settings, output);
  bool clean = true;
  output.write(fitReport(path, input, load_ms, settings, clean));
  return clean;
}

/// The clouds of a list. \return the exit code.
int
fitManifest(const Sensor& sensor, const FitSettings& settings)
{
  return runBatch(settings, [&](const std::string& path) {
    const Stopwatch loading;
    const Input input = loadInput(path, sensor, settings);
    bool ignored = true; // it has been said, and the counts are in the results
    return fitReport(path, input, loading.milliseconds(), settings, ignored);
  });
}

int
runFit(const CLI::App& command, FitSettings& settings)
{
  finishExtractionOptions(command, settings.extraction);
  finishBatchOptions(command, settings);
  const Sensor named = loadSensorOption(settings.input.sensor_name);
  const Sensor sensor = settings.no_pattern ? withoutPattern(named) : named;
  settings.fingerprint = fingerprintOf(command, sensor);
  if (!settings.manifest.empty())
    return fitManifest(sensor, settings);
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
