#include "input_options.h"

#include "command_line.h"

#include <holdfast/io/config.h>
#include <holdfast/io/names.h>
#include <holdfast/pcl/pattern_subtraction.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include <charconv>
#include <cmath>
#include <functional>
#include <stdexcept>

#include <fmt/format.h>

namespace holdfast::app {
namespace {

std::string
joined(const std::vector<std::string>& words)
{
  std::string line;
  for (const std::string& word : words)
    line += (line.empty() ? "" : ", ") + word;
  return line;
}

/// The numbers of an option, whatever the locale; commas and blanks between them.
/// \throw CLI::ValidationError when they are not exactly `n` finite numbers.
std::vector<double>
numbersOf(const std::string& option,
          const std::vector<std::string>& words,
          std::size_t n)
{
  std::vector<double> numbers;
  const auto complain = [&] {
    throw CLI::ValidationError(option, fmt::format("needs {} numbers", n));
  };
  for (const std::string& word : words)
    for (const std::string& text : CLI::detail::split(word, ',')) {
      double value = 0.0;
      const char* end = text.data() + text.size();
      const auto result = std::from_chars(text.data(), end, value);
      if (result.ec != std::errc() || result.ptr != end || !std::isfinite(value))
        complain();
      numbers.push_back(value);
    }
  if (numbers.size() != n)
    complain();
  return numbers;
}

using UseNumbers = std::function<void(const std::vector<double>&)>;

CLI::Option*
addNumbers(CLI::App& command,
           const std::string& name,
           const std::string& type_name,
           std::size_t n,
           const UseNumbers& use,
           const std::string& description)
{
  return command
      .add_option_function<std::vector<std::string>>(
          name,
          [name, n, use](const std::vector<std::string>& words) {
            use(numbersOf(name, words, n));
          },
          description)
      ->type_name(type_name)
      ->group("Input");
}

void
addCameraOptions(CLI::App& command, InputOptions& options)
{
  addNumbers(
      command,
      "--intrinsics",
      "FX,FY,CX,CY",
      4,
      [&options](const std::vector<double>& v) {
        if (v[0] <= 0.0 || v[1] <= 0.0)
          throw CLI::ValidationError("--intrinsics", "FX and FY must be positive");
        Camera camera;
        camera.fx = v[0];
        camera.fy = v[1];
        camera.cx = v[2];
        camera.cy = v[3];
        options.intrinsics = camera;
      },
      "Camera of the depth image or cloud in px, in place of the sensor's")
      ->expected(1);
  command
      .add_option_function<double>(
          "--depth-scale",
          [&options](double scale) {
            options.depth_scale = scale;
            options.depth_scale_given = true;
          },
          "Pixel units per metre of depth images: 1000 for mm, 5000 for TUM")
      ->check(positiveNumber("1/m"))
      ->type_name("")
      ->default_str("1000")
      ->group("Input");
}

constexpr EnumNames<LengthUnit, 4> kLengthUnitNames{{"m", "mm", "cm", "um"}};

double
meters(LengthUnit unit)
{
  switch (unit) {
  case LengthUnit::Meter:
    return 1.0;
  case LengthUnit::Millimeter:
    return 1e-3;
  case LengthUnit::Centimeter:
    return 1e-2;
  case LengthUnit::Micrometer:
    return 1e-6;
  }
  return 1.0;
}

void
addFrameOptions(CLI::App& command, InputOptions& options)
{
  addChoice(command,
            "--unit",
            options.unit,
            kLengthUnitNames,
            "Unit of the coordinates in the file; results are in m")
      ->default_str("m")
      ->group("Input");
  addChoice(command,
            "--axes",
            options.axes,
            kCloudAxesNames,
            "Axes of the sensor: opengl is x right, y up, z back; ros is x forward, y "
            "left, z up")
      ->default_str("x-right,y-down,z-forward")
      ->group("Input");
  addNumbers(
      command,
      "--sensor-pose",
      "X Y Z QW QX QY QZ",
      7,
      [&options](const std::vector<double>& v) {
        const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
        if (!(q.norm() > 1e-6))
          throw CLI::ValidationError("--sensor-pose", "the quaternion is zero");
        options.sensor_pose =
            Pose{q.normalized().toRotationMatrix(), Eigen::Vector3d(v[0], v[1], v[2])};
      },
      "Where the sensor stood in the frame of the cloud, m, in place of the file's "
      "viewpoint")
      ->expected(7);
  addNumbers(
      command,
      "--viewpoint",
      "X Y Z",
      3,
      [&options](const std::vector<double>& v) {
        options.viewpoint = Eigen::Vector3d(v[0], v[1], v[2]);
      },
      "The position of the sensor alone, m")
      ->expected(3);
  exclude(command, "--viewpoint", {"--sensor-pose"});
}

} // namespace

void
addInputOptions(CLI::App& command, InputOptions& options)
{
  command
      .add_option(
          "CLOUD",
          options.clouds,
          "PCD, PLY or 16-bit depth PNG/PGM, - for standard input, or a folder: "
          "every cloud in it")
      ->required();
  addSensorOptions(command, options);
}

void
addSensorOption(CLI::App& command, std::string& name)
{
  command
      .add_option("--sensor",
                  name,
                  "Sensor that took the cloud, a YAML file or one of: " +
                      joined(listSensors()))
      ->type_name("NAME|FILE")
      ->capture_default_str()
      ->group("Input");
}

void
addNoPatternOption(CLI::App& command, bool& no_pattern)
{
  command
      .add_flag("--no-pattern",
                no_pattern,
                "Take the errors of neighbouring pixels as independent, whatever the "
                "sensor file says, and subtract no map of them: as the paper does, and "
                "on a real camera too sure by a factor of 3 to 12")
      ->group("Input");
}

void
addSensorOptions(CLI::App& command, InputOptions& options)
{
  addSensorOption(command, options.sensor_name);
  addCameraOptions(command, options);
  addFrameOptions(command, options);
  command
      .add_option("--max-points",
                  options.max_points,
                  "Refuse a cloud that announces more points than this")
      ->check(CLI::PositiveNumber)
      ->type_name("N")
      ->capture_default_str()
      ->group("Input");
}

Sensor
loadSensorOption(const std::string& name)
{
  try {
    return loadSensor(name);
  }
  catch (const std::runtime_error& error) {
    throw CLI::ValidationError("--sensor", error.what());
  }
}

Sensor
sensorOf(const CloudFileInfo& info, const Sensor& nominal)
{
  return info.camera ? withCamera(nominal, *info.camera) : nominal;
}

LoadOptions
loadOptions(const InputOptions& options, const Sensor& sensor)
{
  LoadOptions load;
  load.depth_scale = options.depth_scale;
  load.depth_scale_given = options.depth_scale_given;
  load.camera = options.intrinsics.value_or(sensor.camera);
  load.camera_given = options.intrinsics.has_value();
  load.camera_name = "the sensor " + sensor.name;
  if (load.camera_given) { // the size of a cloud without a grid is the sensor's
    load.camera.width = sensor.camera.width;
    load.camera.height = sensor.camera.height;
  }
  load.unit_m = meters(options.unit.value_or(LengthUnit::Meter));
  load.axes = options.axes;
  load.sensor_pose = options.sensor_pose;
  load.viewpoint = options.viewpoint;
  load.max_points = options.max_points;
  load.min_range_m = sensor.min_range_m;
  load.max_range_m = sensor.max_range_m;
  return load;
}

LoadOptions
loadOptions(const InputOptions& options,
            const Sensor& sensor,
            const CloudReading& reading)
{
  LoadOptions load = loadOptions(options, sensor);
  if (!reading.file)
    return load;
  const CloudFileInfo& file = *reading.file;
  if (!options.unit)
    load.unit_m = file.unit_m;
  if (!options.axes)
    load.axes = file.axes;
  if (file.is_depth_image && !options.depth_scale_given) {
    load.depth_scale = file.depth_scale;
    load.depth_scale_given = true;
  }
  if (file.camera && !options.intrinsics) {
    load.camera = *file.camera;
    load.camera_given = true;
  }
  return load;
}

RangeCloud
withoutPatternMap(const std::string& path,
                  const RangeCloud& cloud,
                  const Sensor& sensor,
                  std::vector<std::string>& notices)
{
  std::string notice;
  try {
    RangeCloud rest = subtractPatternMap(cloud, sensor, &notice);
    if (!notice.empty())
      notices.push_back(notice);
    return rest;
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

std::vector<std::string>
inputNotices(const InputOptions& options, const CloudFileInfo& info)
{
  std::vector<std::string> notices = info.notices;
  if (options.depth_scale_given && !info.is_depth_image)
    notices.emplace_back("no depth image: --depth-scale does not apply");
  if (options.unit && info.is_depth_image)
    notices.emplace_back("a depth image: --depth-scale applies, not --unit");
  if (options.axes && info.is_depth_image)
    notices.emplace_back("a depth image has the axes of its camera: --axes does not "
                         "apply");
  return notices;
}

std::optional<std::string>
assumedViewpoint(const RangeCloud& cloud, bool is_credible)
{
  const bool is_image = cloud.points->height > 1;
  if (cloud.sensor_pose_given || is_image || !is_credible)
    return std::nullopt;
  return "the file does not say where the cloud was taken from: 0 0 0 is assumed, and "
         "normals show there; --viewpoint X Y Z says otherwise";
}

} // namespace holdfast::app
