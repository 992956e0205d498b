#include "input_options.h"

#include "command_line.h"

#include <holdfast/io/config.h>

#include <CLI/CLI.hpp>

#include <stdexcept>

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

} // namespace

void
addInputOptions(CLI::App& command, InputOptions& options)
{
  command
      .add_option("CLOUD",
                  options.clouds,
                  "PCD, PLY or 16-bit depth PNG/PGM, or a folder: every cloud in it")
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
addSensorOptions(CLI::App& command, InputOptions& options)
{
  addSensorOption(command, options.sensor_name);
  command
      .add_option_function<double>(
          "--depth-scale",
          [&options](double scale) {
            options.depth_scale = scale;
            options.depth_scale_given = true;
          },
          "Pixel units per metre of depth images: 1000 for mm, 5000 for TUM; other "
          "formats are in metres")
      ->check(positiveNumber("1/m"))
      ->type_name("")
      ->default_str("1000")
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

LoadOptions
loadOptions(const InputOptions& options, const Sensor& sensor)
{
  LoadOptions load;
  load.depth_scale = options.depth_scale;
  load.camera = sensor.camera;
  load.min_range_m = sensor.min_range_m;
  load.max_range_m = sensor.max_range_m;
  return load;
}

std::vector<std::string>
inputNotices(const InputOptions& options, const CloudFileInfo& info)
{
  std::vector<std::string> notices = info.notices;
  const bool is_depth_image = info.fields == std::vector<std::string>{"depth"};
  if (options.depth_scale_given && !is_depth_image)
    notices.emplace_back("no depth image: --depth-scale does not apply");
  return notices;
}

} // namespace holdfast::app
