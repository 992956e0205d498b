/// \file The options of `holdfast fit`.
#pragma once

#include "extraction_options.h"
#include "input_options.h"
#include "manifest.h"

#include <cstdint>
#include <string>

namespace holdfast::app {

/// What the results of a manifest's clouds are written as.
enum class BatchFormat : std::uint8_t {
  Json, ///< NAME.patches.json, .pcd and .ply
  Columns ///< NAME.patches.h5
};

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
  std::string manifest; ///< list of clouds; empty: none
  Shard shard; ///< of the manifest
  BatchFormat format = BatchFormat::Json;
  bool resume = false; ///< leave what is done
  bool retry_failed = false;
  std::string fingerprint; ///< of sensor and options (fingerprint.h)
};

/// Adds the options to the command. `settings` must outlive the parsing.
void addFitOptions(CLI::App& command, FitSettings& settings);

/// Checks what no single option can see. \throw CLI::ParseError on a command line with
/// neither clouds nor a manifest, or with what only goes with one.
void finishBatchOptions(const CLI::App& command, const FitSettings& settings);

} // namespace holdfast::app
