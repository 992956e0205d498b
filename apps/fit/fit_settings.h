/// \file The options of `holdfast fit`.
#pragma once

#include "extraction_options.h"
#include "input_options.h"

#include <string>

namespace holdfast::app {

/// Everything the command line of `holdfast fit` decides.
struct FitSettings {
  InputOptions input;
  double sigma_m = 0.0; ///< 0: the noise of the sensor
  bool no_pattern = false;
  bool whole = false;
  int dense_stride = 0; ///< px; 0: no image of patches
  ExtractionSettings extraction;
  std::string output_folder; ///< empty: no files
  std::string json_path; ///< empty: none; "-": standard output
  bool quiet = false;
};

/// Adds the options to the command. `settings` must outlive the parsing.
void addFitOptions(CLI::App& command, FitSettings& settings);

} // namespace holdfast::app
