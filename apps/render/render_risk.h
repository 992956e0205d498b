/// \file Pictures of what `holdfast risk` has found.
#pragma once

#include "input_options.h"
#include "render_colors.h"
#include "risk_result.h"
#include "view.h"

#include <string>
#include <vector>

namespace holdfast::app {

/// What of a result can be drawn.
struct RiskPicture {
  std::string source; ///< file
  bool is_of_map = false; ///< else of a cloud
  CloudReading reading; ///< of that
  std::vector<ExtractedPatch> patches;
  std::vector<Rgb> colors; ///< one each
  std::vector<PictureSole> soles;
};

/// \throw std::runtime_error when the text is no result of `holdfast risk`.
RiskPicture readRisk(const std::string& text);

/// Draws a sole as a plate with an outline and a line to its toe, in the colour of its
/// risk, just above the surface it stands on.
void drawSole(Canvas& canvas, const View& view, const PictureSole& sole);

/// px.
int riskLegendHeight();

/// \param text the colour of words.
void drawRiskLegend(Canvas& canvas, const Frame& frame, const Rgb& text);

} // namespace holdfast::app
