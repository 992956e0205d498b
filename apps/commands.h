/// \file The sub-commands of the program, one source file each.
///
/// Each function adds its command to `app`. When the command has run, `exit_code` is 0,
/// or 1 when some of its work failed but the rest was done (it has said so on standard
/// error). A command that cannot go on throws std::runtime_error with one line, usually
/// "FILE: cause" (exit code 1), or a CLI::ValidationError for options that make no
/// sense together (exit code 2); main() prints both.
#pragma once

#include <CLI/App.hpp>

namespace holdfast::app {

void addCalibrateCommand(CLI::App& app, int& exit_code);
void addCollectCommand(CLI::App& app, int& exit_code);
void addFitCommand(CLI::App& app, int& exit_code);
void addInfoCommand(CLI::App& app, int& exit_code);
void addMapCommand(CLI::App& app, int& exit_code);
void addRenderCommand(CLI::App& app, int& exit_code);
void addReportCommand(CLI::App& app, int& exit_code);
void addRiskCommand(CLI::App& app, int& exit_code);
void addSimulateCommand(CLI::App& app, int& exit_code);

// With HOLDFAST_BUILD_EXPERIMENTS only.
void addExperimentCommand(CLI::App& app, int& exit_code);

// With OpenNI2 only; in live/.
void addLiveCommand(CLI::App& app, int& exit_code);
void addRecordCommand(CLI::App& app, int& exit_code);

} // namespace holdfast::app
