/// \file The experiments of `holdfast experiment`, one source file each.
#pragma once

#include "report.h"

#include "parallel/parallel_for.h"

#include <CLI/App.hpp>

#include <cstdint>
#include <functional>
#include <string>

namespace holdfast::app {

/// What every experiment is told.
struct ExperimentSettings {
  int trials = 0;
  std::uint64_t seed = 1;
  int threads = 0; ///< 0: all cores; no result depends on it
  Progress progress; ///< never empty
};

using ExperimentRun = std::function<Report(const ExperimentSettings&)>;

struct Experiment {
  std::string name; ///< of the command and the files
  std::string summary; ///< one line for the help
  std::string trials_meaning; ///< what --trials counts, for the help
  int default_trials = 1000;
  /// Adds the options that only this experiment has, and returns what is to be called
  /// when they are parsed. It may throw as commands do (commands.h).
  std::function<ExperimentRun(CLI::App& command)> prepare;
  std::string former_name = {}; ///< which still works; empty: none
  int fewest_trials = 2;
};

Experiment tableOneExperiment();
Experiment consistencyExperiment();
Experiment figureFiveExperiment();
Experiment figureSixExperiment();
Experiment neighborhoodsExperiment();
Experiment pclExperiment();
Experiment realExperiment();
Experiment fusionExperiment();
Experiment mapExperiment();
Experiment riskExperiment();

/// Adds --data DIR, the folder of recorded clouds (also from the environment variable
/// HOLDFAST_DATA_DIR). `folder` must outlive the parsing.
void addDataOption(CLI::App& command, std::string& folder);

/// Progress of one of several equal stages, for one bar over all.
Progress stageProgress(const Progress& progress, int stage, int stages);

} // namespace holdfast::app
