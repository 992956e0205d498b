/// \file The options that mean the same in every sub-command that has them.
#pragma once

#include <CLI/App.hpp>

#include <string>
#include <vector>

namespace holdfast::app {

/// Adds --quiet: errors only. Results that --json - asks for are printed all the same.
CLI::Option* addQuietOption(CLI::App& command, bool& quiet);

/// Adds --threads N, 0 for all cores.
CLI::Option* addThreadsOption(CLI::App& command, int& threads);

/// Adds --json FILE, "-" for standard output, on which nothing else is printed then.
/// \param layout what is behind "; " in the help, such as how objects follow each other
/// \param former_name which still works, such as "--json-lines"; empty: none
CLI::Option* addJsonOption(CLI::App& command,
                           std::string& path,
                           const std::string& layout = "",
                           const std::string& former_name = "");

/// \throw std::runtime_error when a file to be written is one of those that are read.
void requireNoInput(const std::string& output, const std::vector<std::string>& inputs);

} // namespace holdfast::app
