/// \file Pictures of what `holdfast risk` has found.
#pragma once

#include "render_colors.h"
#include "view.h"

#include <holdfast/pcl/patch_extraction.h>

#include <string>
#include <vector>

namespace holdfast::app {

/// A sole where a foothold has it.
struct PictureSole {
  std::vector<Eigen::Vector3d> corners; ///< frame of the points, m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(); ///< out of the surface
  Eigen::Vector3d toe = Eigen::Vector3d::Zero(); ///< where its x axis leaves it
  double total = 1.0; ///< its risk
};

/// A result of `holdfast risk`.
struct RiskPicture {
  std::string source; ///< file
  bool is_of_map = false; ///< else of a cloud
  std::vector<ExtractedPatch> patches;
  std::vector<Rgb> colors; ///< one each
  std::vector<PictureSole> soles;
};

/// \throw std::runtime_error when the text is no such result.
RiskPicture readRisk(const std::string& text);

/// Draws a sole as a plate with an outline and a line to its toe, in the colour of its
/// risk, just above the surface it stands on.
void drawSole(Canvas& canvas, const View& view, const PictureSole& sole);

/// px.
int riskLegendHeight();

/// \param text the colour of words.
void drawRiskLegend(Canvas& canvas, const Frame& frame, const Rgb& text);

} // namespace holdfast::app
