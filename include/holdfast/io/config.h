/// \file Sensors from YAML files.
#pragma once

#include <holdfast/sensor/sensor.h>

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

/// Names of the built-in sensors, sorted.
std::vector<std::string> listSensors();

} // namespace holdfast
