#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "map/frame_poses.h"
#include "map/map_output.h"
#include "map/map_settings.h"
#include "map/map_summary.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/io/patch_map_file.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/pcl/intrinsics.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  holdfast simulate boulder_field --trajectory walk --frames 40 -o walk
  holdfast map walk --poses walk/trajectory.txt -o walk.json --ply walk.ply
      patches over a walk, and how sure they become with every view
  holdfast map walk -o walk.json
      the same without poses: each frame finds its own from the patches
  holdfast map walk --frames 20 -o first.map
  holdfast map later --resume first.map -o both.map -o both.json
      goes on where it stopped

A map follows the sensor: the covariance of a patch is that of where it lies from the
sensor at the last frame. With poses, results are in their frame, else in that of the
first frame. A pose that is the same as the one before means that the sensor stood still,
and what its pixels share does not average then.
)";

/// Files in the order they are taken.
std::vector<std::string>
framesOf(const MapSettings& settings)
{
  std::vector<std::string> frames;
  for (const std::string& path : settings.input.clouds) {
    if (fs::path(path).extension() == ".oni")
      throw std::runtime_error(path +
                               ": is a recording; 'holdfast live --every-frame "
                               "--device FILE.oni --map FILE' makes a map of it");
    if (!fs::is_directory(path)) {
      frames.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.is_regular_file() && isCloudFile(entry.path().string()))
        inside.push_back(entry.path().string());
    if (inside.empty())
      throw std::runtime_error(path + ": no frame in this folder");
    std::sort(inside.begin(), inside.end());
    frames.insert(frames.end(), inside.begin(), inside.end());
  }
  if (settings.frames > 0 && frames.size() > static_cast<std::size_t>(settings.frames))
    frames.resize(static_cast<std::size_t>(settings.frames));
  return frames;
}

/// Goes through the frames.
class Mapping {
public:
  Mapping(const MapSettings& settings, const Sensor& sensor)
  : settings_(settings), sensor_(sensor)
  {
    source_.sensor = sensor;
    source_.options = settings.extraction.options;
  }

  void run(const std::vector<std::string>& frames)
  {
    std::vector<Pose> poses;
    if (!settings_.poses.empty() && settings_.poses != "none") {
      std::vector<std::string> notices;
      poses = posesOf(frames, settings_.poses, notices);
      if (!settings_.pose_sigma_given)
        notices.push_back("steps between poses count as known to 1 mrad and 1 mm; "
                          "--pose-sigma says otherwise");
      note(settings_.poses, notices);
    }
    start(poses);
    ProgressBar bar("mapping", !settings_.quiet);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      add(frames[i], i, poses);
      bar.update(static_cast<int>(i + 1), static_cast<int>(frames.size()));
    }
  }

  const PatchMap& map() const
  {
    return mapper_->map();
  }

  const std::vector<double>& singleSigmas() const
  {
    return single_sigmas_;
  }

  /// What was learned of the frames; without a name.
  const MapSource& source() const
  {
    return source_;
  }

private:
  void note(const std::string& path, const std::vector<std::string>& notices)
  {
    for (const std::string& notice : notices)
      if (source_.addNotice(notice) && !settings_.quiet)
        printNotice(path + ": " + notice);
  }

  void start(const std::vector<Pose>& poses)
  {
    const MappingOptions options =
        mappingOptionsFor(sensor_, settings_.extraction.options);
    if (settings_.resume.empty()) {
      PatchMap::Snapshot empty;
      empty.options = options.map;
      if (!poses.empty())
        empty.pose = poses.front();
      mapper_.emplace(sensor_, options, PatchMap(empty));
      return;
    }
    StoredMap stored = loadPatchMap(settings_.resume);
    if (stored.sensor != sensor_.name)
      throw std::runtime_error(fmt::format("{}: is a map of sensor {}, not of {}",
                                           settings_.resume,
                                           stored.sensor,
                                           sensor_.name));
    if (!poses.empty())
      last_pose_ = stored.map.pose();
    mapper_.emplace(sensor_, options, std::move(stored.map));
  }

  RangeCloud load(const std::string& path)
  {
    CloudFileInfo file;
    RangeCloud cloud = loadCloud(path, loadOptions(settings_.input, sensor_), &file);
    std::vector<std::string> notices = inputNotices(settings_.input, file);
    cloud = withoutPatternMap(path, cloud, sensorOf(file, sensor_), notices);
    if (!source_.file) { // the others are of the same camera
      std::string notice;
      matchedSensor(sensorOf(file, sensor_), cloud, &notice);
      if (!notice.empty())
        notices.push_back(notice);
    }
    note(path, notices);
    source_.file = file;
    if (cloud.points->height < 2)
      throw std::runtime_error(path + ": a map wants frames of a camera, and these "
                                      "points lie on no rows and columns");
    return cloud;
  }

  void add(const std::string& path, std::size_t index, const std::vector<Pose>& poses)
  {
    const RangeCloud cloud = load(path);
    const Stopwatch clock;
    const FrameReport report = addTo(cloud, index, poses);
    if (!settings_.quiet)
      std::cout << frameLine(fs::path(path).filename().string(),
                             report,
                             map().patches().size(),
                             clock.milliseconds());
    note(path, report.extraction.notices);
    source_.addFrame(report.extraction);
    for (const ExtractedPatch& patch : report.extraction.patches)
      single_sigmas_.push_back(centreSigma(patch.fit, patch.fit.state.normal));
  }

  FrameReport addTo(const RangeCloud& cloud,
                    std::size_t index,
                    const std::vector<Pose>& poses)
  {
    if (poses.empty())
      return mapper_->addUnknown(cloud);
    const std::optional<Pose> before = last_pose_;
    last_pose_ = poses[index];
    if (!before)
      return mapper_->addStill(cloud);
    const Pose increment = before->inverse() * poses[index];
    if (isStill(increment))
      return mapper_->addStill(cloud);
    Motion motion{increment, JetMatrix::Zero()};
    const auto [rad, m] = settings_.pose_sigma;
    motion.covariance.diagonal() << Eigen::Vector3d::Constant(rad * rad),
        Eigen::Vector3d::Constant(m * m);
    return mapper_->add(cloud, motion);
  }

  const MapSettings& settings_;
  Sensor sensor_;
  std::optional<FrameMapper> mapper_;
  std::optional<Pose> last_pose_;
  std::vector<double> single_sigmas_;
  MapSource source_;
};

int
runMap(const CLI::App& command, MapSettings& settings)
{
  finishMapOptions(command, settings);
  const Sensor named = loadSensorOption(settings.input.sensor_name);
  const std::vector<std::string> frames = framesOf(settings);
  requireNoInput(settings.output.ply, frames);
  Mapping mapping(settings, settings.no_pattern ? withoutPattern(named) : named);
  mapping.run(frames);
  const std::vector<FitResult> fits =
      fitsOf(mapping.map(), settings.extraction.options.fit);
  if (!settings.quiet)
    std::cout << mapTable(mapping.map(), fits, mapping.singleSigmas()) << std::flush;
  if (mapping.map().patches().empty())
    throw std::runtime_error("no patch in any of the frames: no map is written");
  MapSource source = mapping.source();
  source.name = fmt::format("map of {} frames, {} to {}",
                            frames.size(),
                            fs::path(frames.front()).filename().string(),
                            fs::path(frames.back()).filename().string());
  writeMap(mapping.map(), source, fits, settings.output);
  return 0;
}

} // namespace

void
addMapCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command = app.add_subcommand(
      "map",
      "Fuse the patches of many frames of a moving camera into a map");
  command->footer(kExamples);
  const auto settings = std::make_shared<MapSettings>();
  addMapOptions(*command, *settings);
  command->callback([command, settings, &exit_code] {
    try {
      exit_code = runMap(*command, *settings);
    }
    catch (const CLI::Error&) {
      throw;
    }
    catch (const std::exception& error) {
      printError(error.what());
      exit_code = 1;
    }
  });
}

} // namespace holdfast::app
