/// \file The configuration files that come with Holdfast.
#pragma once

#include <string>
#include <vector>

namespace holdfast::io {

/// A file of that path, or FOLDER/NAME.yaml in the folder named by the environment
/// variable HOLDFAST_CONFIG_DIR, in the installed share/holdfast/config, or in config/
/// of the source tree, in this order.
/// \param what it is of, for the message: "sensor"
/// \throw std::runtime_error with the names there are.
std::string findBuiltIn(const std::string& what,
                        const std::string& folder,
                        const std::string& name_or_path);

/// Names of those in a folder, sorted.
std::vector<std::string> listBuiltIn(const std::string& folder);

} // namespace holdfast::io
