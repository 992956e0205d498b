/// \file The options of `holdfast map`.
#pragma once

#include "extraction_options.h"
#include "input_options.h"
#include "map/map_output.h"

#include <array>
#include <string>
#include <vector>

namespace holdfast::app {

/// Everything the command line of `holdfast map` decides.
struct MapSettings {
  InputOptions input; ///< its clouds are the frames
  bool no_pattern = false;
  ExtractionSettings extraction;
  std::string poses; ///< file in TUM format; empty or "none": from the patches
  std::array<double, 2> pose_sigma{1e-3, 1e-3}; ///< rad and m, per frame
  bool pose_sigma_given = false;
  int frames = 0; ///< of those given, the first so many; 0: all
  std::string resume; ///< map to go on with
  MapOutput output;
  bool quiet = false;
};

/// Adds the options to the command. `settings` must outlive the parsing.
void addMapOptions(CLI::App& command, MapSettings& settings);

/// Checks what no single option can see. \throw CLI::ValidationError.
void finishMapOptions(const CLI::App& command, MapSettings& settings);

} // namespace holdfast::app
