/// \file Which scenes a simulated camera walks through, and how.
#pragma once

#include <CLI/App.hpp>

#include <string>
#include <vector>

namespace holdfast::app {

struct WalkChoice {
  std::vector<std::string> scenes;
  int frames = 0;
  double step_m = 0.1; ///< between frames
  int stride = 2; ///< of pixels
  std::string sensor = "xtion";
};

/// Adds --scene, --frames, --step, --stride and --sensor, which have these defaults.
/// `choice` must outlive the parsing.
void addWalkOptions(CLI::App& command, WalkChoice& choice);

} // namespace holdfast::app
