/// \file The options that say what a cloud comes from.
#pragma once

#include <holdfast/io/cloud_io.h>
#include <holdfast/sensor/sensor.h>

#include <CLI/App.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

/// Of the coordinates in a file.
enum class LengthUnit : std::uint8_t { Meter, Millimeter, Centimeter, Micrometer };

struct InputOptions {
  std::vector<std::string> clouds; ///< files and folders
  std::string sensor_name = "kinect_v1";
  double depth_scale = 1000.0;
  bool depth_scale_given = false;
  std::optional<Camera> intrinsics; ///< fx, fy, cx and cy alone
  std::optional<LengthUnit> unit;
  std::optional<CloudAxes> axes;
  std::optional<Pose> sensor_pose;
  std::optional<Eigen::Vector3d> viewpoint;
  std::uint64_t max_points = LoadOptions{}.max_points;
};

/// How the cloud of a result was read, as far as the result tells.
struct CloudReading {
  std::string cloud; ///< file
  std::optional<CloudFileInfo> file;
  std::optional<Pose> sensor_pose; ///< in the frame of the points
};

/// Adds CLOUD... and what addSensorOptions() adds. `options` must outlive the parsing.
void addInputOptions(CLI::App& command, InputOptions& options);

/// Adds --sensor and what says how a cloud is to be read: --depth-scale, --intrinsics,
/// --unit, --axes, --sensor-pose, --viewpoint, --max-points.
void addSensorOptions(CLI::App& command, InputOptions& options);

/// Adds --sensor alone. `name` must outlive the parsing.
void addSensorOption(CLI::App& command, std::string& name);

/// Adds --no-pattern. `no_pattern` must outlive the parsing.
void addNoPatternOption(CLI::App& command, bool& no_pattern);

/// \throw CLI::ValidationError when there is no such sensor.
Sensor loadSensorOption(const std::string& name);

/// The sensor with the camera that the caller gave or that was assumed for a depth
/// image.
Sensor sensorOf(const CloudFileInfo& info, const Sensor& nominal);

LoadOptions loadOptions(const InputOptions& options, const Sensor& sensor);

/// The same for the cloud of a result: what the caller does not say is as it was then.
LoadOptions loadOptions(const InputOptions& options,
                        const Sensor& sensor,
                        const CloudReading& reading);

/// The cloud of a file less the sensor's pattern map, if it has one.
/// \param notices receives a line where the map is not subtracted.
/// \throw std::runtime_error "FILE: cause" as subtractPatternMap().
RangeCloud withoutPatternMap(const std::string& path,
                             const RangeCloud& cloud,
                             const Sensor& sensor,
                             std::vector<std::string>& notices);

/// What the user should know about the file and how it was read, one line each.
std::vector<std::string> inputNotices(const InputOptions& options,
                                      const CloudFileInfo& info);

/// Of a cloud whose normals show to an origin that the file does not name, and that no
/// rows and columns confirm; none otherwise, or where it is doubted already.
std::optional<std::string> assumedViewpoint(const RangeCloud& cloud, bool is_credible);

} // namespace holdfast::app
