/// \file The options of `holdfast risk`.
#pragma once

#include "input_options.h"

#include <holdfast/contact/foothold.h>

#include <array>
#include <optional>
#include <string>

namespace holdfast::app {

/// Everything the command line of `holdfast risk` decides.
struct RiskSettings {
  std::string source; ///< a map (*.map) or a cloud
  InputOptions input; ///< of a cloud
  bool no_pattern = false;
  std::optional<double> radius_m; ///< of the patches of a cloud; none: from the foot
  std::string foot; ///< name or file
  std::array<double, 3> load_direction{};
  bool load_given = false; ///< else it is down, as far as the frame tells
  std::optional<int> best; ///< footholds; none: all
  FootholdOptions footholds;
  double resolution_m = 0.02; ///< of layers
  std::string output; ///< *.json, or - for standard output; empty: none
  std::string layers; ///< *.png, *.pcd or *.tif; empty: none
  bool quiet = false;
};

/// Adds the options to the command. `settings` must outlive the parsing.
void addRiskOptions(CLI::App& command, RiskSettings& settings);

/// Checks what no single option can see. \throw CLI::ValidationError.
void finishRiskOptions(const CLI::App& command, RiskSettings& settings);

/// True for the file of a map.
bool isMapFile(const std::string& path);

} // namespace holdfast::app
