#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "input_options.h"

#include "io/json_parts.h"
#include "pcl/view_check.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/config.h>
#include <holdfast/io/names.h>
#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

namespace holdfast::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kExamples = R"(Examples:
  holdfast info scene.pcd
  holdfast info clouds/ --json -
  holdfast info scan.ply --unit mm --axes opengl
)";

struct InfoSettings {
  InputOptions input;
  std::string json_path; ///< empty: none; "-": standard output
  bool quiet = false; ///< errors only
};

/// What there is to say about a cloud.
struct CloudFacts {
  std::string path;
  CloudFileInfo file;
  int width = 0;
  int height = 0;
  int valid = 0;
  Eigen::AlignedBox3d bounds; ///< of the valid points, m, in the frame of the file
  double nearest_m = 0.0; ///< depth from the sensor along its axis
  double farthest_m = 0.0;
  Pose sensor_pose; ///< in the frame of the file
  std::optional<Camera> camera; ///< recovered from the points
  double camera_rms_px = 0.0;
  std::vector<std::string> sensors; ///< known ones with such a camera
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< of RangeCloud
  bool has_covariances = false;
  int invalid_covariances = 0;

  double invalidShare() const
  {
    return 1.0 - static_cast<double>(valid) / (static_cast<double>(width) * height);
  }
};

/// The sensors that come with Holdfast or stand beside them, read when first needed.
class KnownSensors {
public:
  /// Names of those with such a camera; what could not be read goes to `notices`.
  std::vector<std::string> like(const Camera& camera, std::vector<std::string>& notices)
  {
    load();
    notices.insert(notices.end(), unreadable_.begin(), unreadable_.end());
    std::vector<std::string> names;
    for (const Sensor& sensor : sensors_)
      if (isOfType(camera, sensor.camera))
        names.push_back(sensor.name);
    return names;
  }

private:
  void load()
  {
    if (loaded_)
      return;
    loaded_ = true;
    for (const std::string& name : listSensors())
      try {
        const Sensor sensor = loadSensor(name);
        // One without noise is for simulated truth: nothing was taken by it.
        if (!sensor.noise->covariance(Eigen::Vector3d::UnitZ()).isZero(0.0))
          sensors_.push_back(sensor);
      }
      catch (const std::runtime_error& error) {
        unreadable_.push_back("no sensor to compare with: " +
                              std::string(error.what()));
      }
  }

  bool loaded_ = false;
  std::vector<Sensor> sensors_;
  std::vector<std::string> unreadable_;
};

void
measureExtent(const RangeCloud& cloud, CloudFacts& facts)
{
  const Pose to_camera = cloud.sensor_pose.inverse();
  facts.nearest_m = std::numeric_limits<double>::infinity();
  facts.farthest_m = -facts.nearest_m;
  for (const auto& point : *cloud.points) {
    if (!pcl::isFinite(point))
      continue;
    const Eigen::Vector3d q = point.getVector3fMap().cast<double>();
    const double depth = to_camera.toWorld(q).z();
    facts.bounds.extend(q + facts.offset);
    facts.nearest_m = std::min(facts.nearest_m, depth);
    facts.farthest_m = std::max(facts.farthest_m, depth);
  }
}

CloudFacts
factsAbout(const std::string& path,
           const InputOptions& input,
           const Sensor& sensor,
           KnownSensors& known)
{
  CloudFacts facts;
  facts.path = path;
  const RangeCloud raw = loadCloud(path, loadOptions(input, sensor), &facts.file);
  facts.file.notices = inputNotices(input, facts.file);
  const std::size_t notices = facts.file.notices.size();
  const Sensor taken_by = matchedSensor(sensorOf(facts.file, sensor), raw);
  const RangeCloud cloud = withoutPatternMap(path, raw, taken_by, facts.file.notices);
  if (sensor.pattern_map && facts.file.notices.size() == notices)
    facts.file.notices.push_back("less the pattern map of the sensor " + sensor.name);
  facts.width = static_cast<int>(cloud.points->width);
  facts.height = static_cast<int>(cloud.points->height);
  facts.valid = countValidPoints(cloud);
  facts.offset = cloud.offset;
  measureExtent(cloud, facts);
  facts.sensor_pose = cloud.sensor_pose;
  facts.sensor_pose.c += cloud.offset;
  facts.camera = recoverIntrinsics(cloud, &facts.camera_rms_px);
  if (facts.camera)
    facts.sensors = known.like(*facts.camera, facts.file.notices);
  if (const std::string hint = ViewCheck(cloud, taken_by).hint(); !hint.empty())
    facts.file.notices.push_back(hint);
  facts.has_covariances = cloud.hasCovariances();
  facts.invalid_covariances = countInvalidCovariances(cloud);
  return facts;
}

/// The camera that the points themselves show.
Json
recoveredJson(const CloudFacts& facts)
{
  if (!facts.camera)
    return {};
  Json json = io::cameraJson(*facts.camera);
  json["rms_px"] = facts.camera_rms_px;
  return json;
}

Json
factsJson(const CloudFacts& facts)
{
  const Eigen::Vector3d low = facts.bounds.min();
  const Eigen::Vector3d high = facts.bounds.max();
  Json covariances;
  if (facts.has_covariances)
    covariances = {{"valid", facts.valid - facts.invalid_covariances},
                   {"invalid", facts.invalid_covariances}};
  return {{"cloud", facts.path},
          {"format", facts.file.format},
          {"width", facts.width},
          {"height", facts.height},
          {"organized", facts.height > 1},
          {"fields", facts.file.fields},
          {"valid_points", facts.valid},
          {"invalid_points", facts.width * facts.height - facts.valid},
          {"nan_share", facts.invalidShare()},
          {"zero_points", facts.file.zero_points},
          {"out_of_range_pixels", facts.file.out_of_range_pixels},
          {"min", {low.x(), low.y(), low.z()}},
          {"max", {high.x(), high.y(), high.z()}},
          {"depth_range", {facts.nearest_m, facts.farthest_m}},
          {"unit_m", facts.file.unit_m},
          {"axes", kCloudAxesNames.of(facts.file.axes)},
          {"offset", {facts.offset.x(), facts.offset.y(), facts.offset.z()}},
          {"camera", facts.file.camera ? io::cameraJson(*facts.file.camera) : Json()},
          {"viewpoint",
           facts.file.viewpoint ? io::poseJson(*facts.file.viewpoint) : Json()},
          {"sensor_pose", io::poseJson(facts.sensor_pose)},
          {"intrinsics", recoveredJson(facts)},
          {"sensors", facts.sensors},
          {"covariances", covariances},
          {"notices", facts.file.notices}};
}

std::string
vectorText(const Eigen::Vector3d& v)
{
  return fmt::format("{:.3f} {:.3f} {:.3f}", v.x(), v.y(), v.z());
}

std::string
poseText(const Pose& pose)
{
  const Eigen::Quaterniond q(pose.R);
  return fmt::format("at {} m, orientation (w x y z) {:.4f} {:.4f} {:.4f} {:.4f}",
                     vectorText(pose.c),
                     q.w(),
                     q.x(),
                     q.y(),
                     q.z());
}

std::string
cameraText(const Camera& camera)
{
  return fmt::format("fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f} px",
                     camera.fx,
                     camera.fy,
                     camera.cx,
                     camera.cy);
}

std::string
recoveredText(const CloudFacts& facts)
{
  if (!facts.camera)
    return facts.height > 1 ? "none fit the pixel grid" : "none, not organized";
  return fmt::format("{}, rms {:.2f} px",
                     cameraText(*facts.camera),
                     facts.camera_rms_px);
}

/// Sensors whose pixels these may be, for --sensor.
std::string
sensorsText(const CloudFacts& facts)
{
  if (facts.sensors.empty())
    return facts.camera ? "  like         no sensor known by name\n" : "";
  return fmt::format("  like         {}\n", fmt::join(facts.sensors, ", "));
}

std::string
covarianceText(const CloudFacts& facts)
{
  if (!facts.has_covariances)
    return "none";
  return fmt::format("{} valid, {} invalid",
                     facts.valid - facts.invalid_covariances,
                     facts.invalid_covariances);
}

/// What was not simply taken from the file.
std::string
appliedText(const CloudFacts& facts)
{
  std::string text;
  if (facts.file.unit_m != 1.0)
    text += fmt::format("  unit         {} m\n", facts.file.unit_m);
  if (facts.file.axes != CloudAxes::Camera)
    text += fmt::format("  axes         {}\n", kCloudAxesNames.of(facts.file.axes));
  if (!facts.offset.isZero(0.0))
    text += fmt::format("  offset       {} m\n", vectorText(facts.offset));
  if (facts.file.camera)
    text += fmt::format("  camera       {}\n", cameraText(*facts.file.camera));
  return text;
}

std::string
factsText(const CloudFacts& facts)
{
  std::string text = fmt::format("{}\n  format       {}\n  fields       {}\n",
                                 facts.path == "-" ? "standard input" : facts.path,
                                 facts.file.format,
                                 fmt::join(facts.file.fields, " "));
  text += fmt::format("  size         {} x {}, {}, {} valid points, {:.1f} % invalid\n",
                      facts.width,
                      facts.height,
                      facts.height > 1 ? "organized" : "not organized",
                      facts.valid,
                      100.0 * facts.invalidShare());
  text += fmt::format("  bounds       {} to {} m\n  depth        {:.3f} to {:.3f} m\n",
                      vectorText(facts.bounds.min()),
                      vectorText(facts.bounds.max()),
                      facts.nearest_m,
                      facts.farthest_m);
  text += appliedText(facts);
  text += fmt::format(
      "  viewpoint    {}\n  sensor       {}\n  intrinsics   {}\n{}  covariances  {}\n",
      facts.file.viewpoint ? poseText(*facts.file.viewpoint) : "none",
      poseText(facts.sensor_pose),
      recoveredText(facts),
      sensorsText(facts),
      covarianceText(facts));
  for (const std::string& notice : facts.file.notices)
    text += fmt::format("  note         {}\n", notice);
  return text;
}

int
runInfo(const InfoSettings& settings)
{
  const Sensor sensor = loadSensorOption(settings.input.sensor_name);
  std::optional<AtomicFile> file;
  if (!settings.json_path.empty() && settings.json_path != "-") {
    requireNoInput(settings.json_path, settings.input.clouds);
    file.emplace(settings.json_path);
  }
  bool has_json = false;
  KnownSensors known;
  const int exit_code =
      forEachCloud(settings.input.clouds, [&](const std::string& path) {
        const CloudFacts facts = factsAbout(path, settings.input, sensor, known);
        if (settings.json_path != "-" && !settings.quiet)
          std::cout << factsText(facts) << std::flush;
        if (settings.json_path.empty())
          return true;
        // File names need not be UTF-8; JSON must.
        (file ? file->stream() : std::cout)
            << factsJson(facts).dump(-1, ' ', false, Json::error_handler_t::replace)
            << '\n';
        has_json = true;
        return true;
      });
  if (file && has_json)
    file->commit();
  return exit_code;
}

} // namespace

void
addInfoCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command = app.add_subcommand("info", "Say what is in clouds");
  command->footer(kExamples);
  const auto settings = std::make_shared<InfoSettings>();
  addInputOptions(*command, settings->input);
  addJsonOption(*command,
                settings->json_path,
                "one object per cloud, each on a line of its own");
  addQuietOption(*command, settings->quiet);
  tidyHelp(*command);
  command->callback([settings, &exit_code] { exit_code = runInfo(*settings); });
}

} // namespace holdfast::app
