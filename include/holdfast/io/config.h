/// \file Sensors from YAML files.
#pragma once

#include <holdfast/sensor/noise_registry.h>
#include <holdfast/sensor/sensor.h>

#include <map>
#include <string>
#include <vector>

namespace holdfast {

/// A sensor from a YAML file (config/sensors/kinect_v1.yaml explains the keys).
///
/// \param name_or_path a file, or the name of a built-in sensor, which is looked for as
/// sensors/NAME.yaml in the folder named by the environment variable
/// HOLDFAST_CONFIG_DIR, in the installed share/holdfast/config, and in config/ of the
/// source tree, in this order.
/// \throw std::runtime_error with file, line and key in one line when there is no such
/// sensor, the file is no YAML, a key is missing, unknown or given twice, or a value
/// has the wrong type or makes no sense.
Sensor loadSensor(const std::string& name_or_path);

/// Comments of a sensor file: the text above a key by its name, such as "camera.fx";
/// the one without a name opens the file. Long lines are broken between words.
using SensorComments = std::map<std::string, std::string>;

/// Writes a file from which loadSensor() makes the same sensor, to the last digit.
///
/// \param noise the parameters that sensor.noise was made from, which it does not tell.
/// \param map_file of sensor.pattern_map, as seen from the folder of `path`; it is not
/// written here (savePatternMap). Empty for a sensor without.
/// \throw std::invalid_argument when they do not suit its model, the pattern makes no
/// sense or is more than the noise of a point, a comment has no key to stand above, or
/// map and file do not go together.
/// \throw std::runtime_error when the file cannot be written; then there is none, or
/// the one from before.
void saveSensor(const std::string& path,
                const Sensor& sensor,
                const NoiseParameters& noise,
                const SensorComments& comments = {},
                const std::string& map_file = {});

/// Names of the built-in sensors, sorted.
std::vector<std::string> listSensors();

} // namespace holdfast
