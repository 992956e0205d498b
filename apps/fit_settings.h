/// \file The options of `holdfast fit`.
#pragma once

#include "input_options.h"

#include <holdfast/pcl/patch_extraction.h>

#include <cstdint>
#include <string>

namespace holdfast {

/// Everything the command line of `holdfast fit` decides.
struct FitSettings {
  InputOptions input;
  bool whole = false;
  bool paper = false;
  /// Complete after finishFitSettings().
  ExtractionOptions extraction;
  std::string output_folder; ///< empty: no files
  std::string json_path; ///< empty: none; "-": standard output
  bool quiet = false;
};

/// Adds the options to the command. `settings` must outlive the parsing.
void addFitOptions(CLI::App& command, FitSettings& settings);

/// Checks what no single option can see. \throw CLI::ValidationError on combinations
/// that make no sense.
void finishFitSettings(const CLI::App& command, FitSettings& settings);

} // namespace holdfast
