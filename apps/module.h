/// \file Parts of the program that are loaded when they are wanted: what they stand on
/// (VTK, PCL's features) would slow the start of every command, and need not be there.
#pragma once

#include <string>

namespace holdfast::app {

/// A function of a module, which stays loaded until the program ends.
/// \param name of the file, without its extension; beside the program, in the build
/// folder as when installed
/// \param function as the module exports it
/// \throw std::runtime_error in one line: not built, or cannot be loaded.
void* loadModuleFunction(const std::string& name, const std::string& function);

} // namespace holdfast::app
