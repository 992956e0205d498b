#include "recordings.h"

#include "experiment.h"
#include "input_options.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/intrinsics.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

#ifdef HOLDFAST_RECORDINGS
constexpr const char* kRecordings = HOLDFAST_RECORDINGS;
#else
constexpr const char* kRecordings = "";
#endif

/// The clouds by default: of a tripod before a table.
std::vector<std::string>
tablesIn(const std::string& folder)
{
  std::vector<std::string> paths;
  if (fs::is_directory(folder))
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name.rfind("mosd_", 0) == 0 && entry.path().extension() == ".pcd")
        paths.push_back(entry.path().string());
    }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<std::string>
pathsOf(const RecordingOptions& options)
{
  if (!options.clouds.empty())
    return options.clouds;
  if (options.folder.empty())
    throw CLI::ValidationError("no recordings",
                               "name clouds with --clouds, or a folder of mosd_*.pcd "
                               "with --data");
  std::vector<std::string> paths = tablesIn(options.folder);
  if (paths.empty())
    throw std::runtime_error(options.folder + ": no recordings mosd_*.pcd there; "
                                              "name clouds with --clouds");
  return paths;
}

std::string
planeRemark(const RecordedCloud& recording)
{
  const RecordedPlane& plane = recording.plane;
  return fmt::format("{}: plane of {} pixels, at {:.2f} m; rms about it {:.2f} sigmas "
                     "of single points",
                     recording.name,
                     plane.pixels,
                     plane.mean_depth_m,
                     plane.rms_sigmas);
}

/// Nothing where there is no plane, which a remark says then.
std::optional<RecordedCloud>
loadRecording(const std::string& path,
              const Sensor& nominal,
              std::uint64_t seed,
              std::vector<std::string>& remarks)
{
  InputOptions input;
  CloudFileInfo info;
  RecordedCloud recording;
  recording.name = fs::path(path).stem().string();
  recording.cloud = loadCloud(path, loadOptions(input, nominal), &info);
  if (recording.cloud.points->height < 2)
    throw std::runtime_error(path + ": not organized, the pixels of its points are "
                                    "lost");
  std::vector<std::string> notices = inputNotices(input, info);
  std::string notice;
  recording.sensor = matchedSensor(sensorOf(info, nominal), recording.cloud, &notice);
  if (!notice.empty())
    notices.push_back(notice);
  if (recording.cloud.hasCovariances())
    notices.emplace_back("its own covariances count, and no pattern");
  recording.cloud = withoutPatternMap(path, recording.cloud, recording.sensor, notices);
  for (const std::string& line : notices)
    remarks.push_back(recording.name + ": " + line);
  const auto plane = findLargestPlane(recording.cloud, recording.sensor, seed);
  if (!plane) {
    remarks.push_back(fmt::format("{}: left out, no plane of {} pixels",
                                  recording.name,
                                  kLeastPlanePixels));
    return std::nullopt;
  }
  recording.plane = *plane;
  remarks.push_back(planeRemark(recording));
  return recording;
}

} // namespace

void
addRecordingOptions(CLI::App& command, RecordingOptions& options)
{
  options.folder = kRecordings;
  command
      .add_option("--clouds",
                  options.clouds,
                  "Organized clouds with a large plane, in place of the mosd_*.pcd of "
                  "--data")
      ->type_name("FILE...")
      ->check(CLI::ExistingFile)
      ->group("Input");
  addDataOption(command, options.folder);
  addSensorOption(command, options.sensor_name);
}

std::vector<RecordedCloud>
loadRecordings(const RecordingOptions& options,
               std::uint64_t seed,
               std::vector<std::string>& remarks)
{
  const Sensor nominal = loadSensorOption(options.sensor_name);
  std::vector<RecordedCloud> recordings;
  for (const std::string& path : pathsOf(options))
    if (auto recording = loadRecording(path, nominal, seed, remarks))
      recordings.push_back(std::move(*recording));
  if (recordings.empty())
    throw std::runtime_error("no plane of " + std::to_string(kLeastPlanePixels) +
                             " pixels in any recording");
  return recordings;
}

} // namespace holdfast::app
