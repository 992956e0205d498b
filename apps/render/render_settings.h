/// \file The options of `holdfast render`.
#pragma once

#include "input_options.h"
#include "render_colors.h"

#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

/// Where an orthographic view stands, degrees: to the right of the sensor's side, and
/// above the ground.
struct Aside {
  double azimuth = 35.0;
  double elevation = 30.0;
};

/// Everything the command line of `holdfast render` decides.
struct RenderSettings {
  std::vector<std::string> results;
  std::string cloud; ///< empty: the one a result names
  bool types = false; ///< the ten types instead of results
  std::string output;
  const Measure* measure = nullptr; ///< that colours show; null: the type
  bool risk = false; ///< they show the risk, and the results are of `holdfast risk`
  std::optional<Aside> aside; ///< nothing: from the sensor
  int width = 960; ///< px
  int height = 720; ///< px
  double zoom = 1.0;
  Rgb background{255, 255, 255};
  std::optional<int> max_patches; ///< of one result
  bool quiet = false; ///< errors only
  InputOptions input; ///< of clouds that are depth images
};

/// Adds the options to the command. `settings` must outlive the parsing.
void addRenderOptions(CLI::App& command, RenderSettings& settings);

/// Checks what no single option can see. \throw CLI::ValidationError on combinations
/// that make no sense.
void checkRenderSettings(const RenderSettings& settings);

} // namespace holdfast::app
