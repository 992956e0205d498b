/// \file The options that say which patches are wanted and how they are fitted.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <CLI/App.hpp>

namespace holdfast::app {

/// Which patches are given.
enum class Accept {
  Default, ///< those that keep the limits
  All ///< also those that do not, with their verdict
};

struct ExtractionSettings {
  /// Complete after finishExtractionOptions().
  ExtractionOptions options;
  bool paper = false;
  Accept accept = Accept::Default;
  double max_view_angle_deg = 85.0;
};

/// Adds surfaces, neighbourhoods, validation and threads. `settings` must outlive the
/// parsing.
void addExtractionOptions(CLI::App& command, ExtractionSettings& settings);

/// Checks what no single option can see. \throw CLI::ValidationError on combinations
/// that make no sense.
void finishExtractionOptions(const CLI::App& command, ExtractionSettings& settings);

} // namespace holdfast::app
