/// \file Feet from YAML files.
#pragma once

#include <holdfast/contact/foot.h>

#include <string>
#include <vector>

namespace holdfast {

/// A foot from a YAML file (config/feet/humanoid_foot.yaml explains the keys).
///
/// \param name_or_path a file, or the name of a built-in foot, which is looked for as
/// feet/NAME.yaml where loadSensor() looks for sensors/NAME.yaml.
/// \throw std::runtime_error with file, line and key in one line when there is no such
/// foot, the file is no YAML, a key is missing, unknown or given twice, or a value has
/// the wrong type or makes no sense (validityError(Foot)).
Foot loadFoot(const std::string& name_or_path);

/// Names of the built-in feet, sorted.
std::vector<std::string> listFeet();

} // namespace holdfast
