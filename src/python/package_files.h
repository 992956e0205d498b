/// \file Sensors and feet that come with the package.
#pragma once

#include <string>
#include <vector>

namespace holdfast::python {

/// Where the package has folders of built-in YAML files; empty: nowhere.
std::string& packageFolder();

/// \param kind folder of the package: "sensors" or "feet".
/// \param known what the library's own loader finds, which stays as it is.
/// \return the package's file where that alone has one of the name, else the name.
std::string foundInPackage(const std::string& kind,
                           const std::vector<std::string>& known,
                           const std::string& name_or_path);

/// Names that the library or the package knows, sorted.
std::vector<std::string> builtInNames(const std::string& kind,
                                      const std::vector<std::string>& known);

} // namespace holdfast::python
