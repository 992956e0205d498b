#include "command_line.h"
#include "commands.h"
#include "console.h"
#include "input_options.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <iostream>
#include <memory>
#include <optional>

namespace holdfast::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kExamples = R"(Examples:
  holdfast info scene.pcd
  holdfast info clouds/ --json -
)";

struct InfoSettings {
  InputOptions input;
  std::string json_path; ///< empty: none; "-": standard output
};

/// What there is to say about a cloud.
struct CloudFacts {
  std::string path;
  CloudFileInfo file;
  int width = 0;
  int height = 0;
  int valid = 0;
  Eigen::AlignedBox3d bounds; ///< of the valid points, m
  double nearest_m = 0.0; ///< depth from the sensor along its axis
  double farthest_m = 0.0;
  Pose sensor_pose;
  std::optional<Camera> camera; ///< recovered from the points
  double camera_rms_px = 0.0;
  bool has_covariances = false;
  int invalid_covariances = 0;

  double nanShare() const
  {
    return 1.0 - static_cast<double>(valid) / (static_cast<double>(width) * height);
  }
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
    facts.bounds.extend(q);
    facts.nearest_m = std::min(facts.nearest_m, depth);
    facts.farthest_m = std::max(facts.farthest_m, depth);
  }
}

CloudFacts
factsAbout(const std::string& path, const InputOptions& input, const Sensor& sensor)
{
  CloudFacts facts;
  facts.path = path;
  const RangeCloud cloud = loadCloud(path, loadOptions(input, sensor), &facts.file);
  facts.file.notices = inputNotices(input, facts.file);
  facts.width = static_cast<int>(cloud.points->width);
  facts.height = static_cast<int>(cloud.points->height);
  facts.valid = countValidPoints(cloud);
  measureExtent(cloud, facts);
  facts.sensor_pose = cloud.sensor_pose;
  facts.camera = recoverIntrinsics(cloud, &facts.camera_rms_px);
  facts.has_covariances = !cloud.covariances.empty();
  facts.invalid_covariances = countInvalidCovariances(cloud);
  return facts;
}

Json
poseJson(const Pose& pose)
{
  const Eigen::Quaterniond q(pose.R);
  return {{"position", {pose.c.x(), pose.c.y(), pose.c.z()}},
          {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

Json
cameraJson(const CloudFacts& facts)
{
  const Camera& camera = *facts.camera;
  return {{"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"rms_px", facts.camera_rms_px}};
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
  return {
      {"cloud", facts.path},
      {"format", facts.file.format},
      {"width", facts.width},
      {"height", facts.height},
      {"organized", facts.height > 1},
      {"fields", facts.file.fields},
      {"valid_points", facts.valid},
      {"nan_share", facts.nanShare()},
      {"min", {low.x(), low.y(), low.z()}},
      {"max", {high.x(), high.y(), high.z()}},
      {"depth_range", {facts.nearest_m, facts.farthest_m}},
      {"viewpoint", facts.file.viewpoint ? poseJson(*facts.file.viewpoint) : Json()},
      {"sensor_pose", poseJson(facts.sensor_pose)},
      {"intrinsics", facts.camera ? cameraJson(facts) : Json()},
      {"covariances", covariances},
      {"notices", facts.file.notices}};
}

std::string
vectorText(const Eigen::Vector3d& v)
{
  return formatNumber("%.3f ", v.x()) + formatNumber("%.3f ", v.y()) +
         formatNumber("%.3f", v.z());
}

std::string
poseText(const Pose& pose)
{
  const Eigen::Quaterniond q(pose.R);
  return "at " + vectorText(pose.c) + " m, orientation (w x y z) " +
         formatNumber("%.4f ", q.w()) + formatNumber("%.4f ", q.x()) +
         formatNumber("%.4f ", q.y()) + formatNumber("%.4f", q.z());
}

std::string
cameraText(const CloudFacts& facts)
{
  if (!facts.camera)
    return facts.height > 1 ? "none fit the pixel grid" : "none, not organized";
  const Camera& camera = *facts.camera;
  return "fx " + formatNumber("%.1f", camera.fx) + ", fy " +
         formatNumber("%.1f", camera.fy) + ", cx " + formatNumber("%.1f", camera.cx) +
         ", cy " + formatNumber("%.1f", camera.cy) + " px, rms " +
         formatNumber("%.2f", facts.camera_rms_px) + " px";
}

std::string
covarianceText(const CloudFacts& facts)
{
  if (!facts.has_covariances)
    return "none";
  return std::to_string(facts.valid - facts.invalid_covariances) + " valid, " +
         std::to_string(facts.invalid_covariances) + " invalid";
}

std::string
factsText(const CloudFacts& facts)
{
  std::string fields;
  for (const std::string& field : facts.file.fields)
    fields += (fields.empty() ? "" : " ") + field;
  const std::string size = std::to_string(facts.width) + " x " +
                           std::to_string(facts.height) +
                           (facts.height > 1 ? ", organized, " : ", not organized, ") +
                           std::to_string(facts.valid) + " valid points, " +
                           formatNumber("%.1f", 100.0 * facts.nanShare()) + " % NaN";
  std::string text =
      facts.path + "\n  format       " + facts.file.format + "\n  fields       " +
      fields + "\n  size         " + size + "\n  bounds       " +
      vectorText(facts.bounds.min()) + " to " + vectorText(facts.bounds.max()) +
      " m\n  depth        " + formatNumber("%.3f to ", facts.nearest_m) +
      formatNumber("%.3f m", facts.farthest_m) + "\n  viewpoint    " +
      (facts.file.viewpoint ? poseText(*facts.file.viewpoint) : "none") +
      "\n  sensor       " + poseText(facts.sensor_pose) + "\n  intrinsics   " +
      cameraText(facts) + "\n  covariances  " + covarianceText(facts) + "\n";
  for (const std::string& notice : facts.file.notices)
    text += "  note         " + notice + "\n";
  return text;
}

int
runInfo(const InfoSettings& settings)
{
  const Sensor sensor = loadSensorOption(settings.input.sensor_name);
  std::optional<AtomicFile> file;
  if (!settings.json_path.empty() && settings.json_path != "-")
    file.emplace(settings.json_path);
  bool has_json = false;
  const int exit_code =
      forEachCloud(settings.input.clouds, [&](const std::string& path) {
        const CloudFacts facts = factsAbout(path, settings.input, sensor);
        if (settings.json_path.empty()) {
          std::cout << factsText(facts) << std::flush;
          return true;
        }
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
  command
      ->add_option("--json",
                   settings->json_path,
                   "Write JSON to this file, or with - to standard output; one object "
                   "per cloud, each on a line of its own")
      ->type_name("FILE")
      ->group("Output");
  tidyHelp(*command);
  command->callback([settings, &exit_code] { exit_code = runInfo(*settings); });
}

} // namespace holdfast::app
