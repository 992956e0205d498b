/// \file The options that say what a cloud comes from.
#pragma once

#include <holdfast/io/cloud_io.h>
#include <holdfast/sensor/sensor.h>

#include <CLI/App.hpp>

#include <string>
#include <vector>

namespace holdfast::app {

struct InputOptions {
  std::vector<std::string> clouds; ///< files and folders
  std::string sensor_name = "kinect_v1";
  double depth_scale = 1000.0;
  bool depth_scale_given = false;
};

/// Adds CLOUD..., --sensor and --depth-scale. `options` must outlive the parsing.
void addInputOptions(CLI::App& command, InputOptions& options);

/// Adds --sensor and --depth-scale.
void addSensorOptions(CLI::App& command, InputOptions& options);

/// Adds --sensor alone. `name` must outlive the parsing.
void addSensorOption(CLI::App& command, std::string& name);

/// \throw CLI::ValidationError when there is no such sensor.
Sensor loadSensorOption(const std::string& name);

LoadOptions loadOptions(const InputOptions& options, const Sensor& sensor);

/// What the user should know about the file and how it was read, one line each.
std::vector<std::string> inputNotices(const InputOptions& options,
                                      const CloudFileInfo& info);

} // namespace holdfast::app
