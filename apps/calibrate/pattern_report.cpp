#include "pattern_report.h"

#include "estimate_text.h"

#include <holdfast/sensor/names.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace holdfast::app {
namespace {

using Json = nlohmann::ordered_json;
using Table = std::vector<std::vector<std::string>>;

bool
isMeasured(const NoiseReport& report)
{
  return report.pattern.status == NoiseCalibrationStatus::Ok;
}

std::string
shapeText(const WaveEstimate& wave)
{
  return std::string(kPatternShapeNames.of(wave.shape));
}

/// Whether a length or its interval was cut off.
bool
hasCutOffWave(const NoiseReport& report)
{
  const auto& waves = report.pattern.waves;
  return std::any_of(waves.begin(), waves.end(), [](const WaveEstimate& wave) {
    return std::isinf(wave.length.high);
  });
}

std::string
poseSentence(const NoiseReport& report)
{
  if (report.pattern.poses == 1)
    return "One pose: the shape of the surfaces themselves is part of the pattern. "
           "Frames from another place, as --pose, tell how much belongs to the camera.";
  return fmt::format(
      "{} poses: {} of the variance between points 8 to 75 px apart{} is "
      "in the same pixels of other poses and belongs to the camera; the "
      "rest changes with time or distance, or is the shape of the "
      "surfaces.",
      report.pattern.poses,
      valueAndInterval(report.pattern.shared_part),
      report.hasMap() ? ", before the map," : "");
}

/// Estimates over the distance, and their intervals as vertical lines.
void
addPoints(Panel& panel,
          const std::string& name,
          const std::vector<double>& distances,
          const std::vector<Estimate>& estimates)
{
  Series points{name, {}, {}, SeriesStyle::Markers};
  std::vector<Series> bars;
  for (std::size_t a = 0; a < distances.size(); ++a) {
    const Estimate& estimate = estimates[a];
    if (!estimate.isKnown())
      continue;
    points.x.push_back(distances[a]);
    points.y.push_back(estimate.value);
    if (std::isfinite(estimate.low))
      bars.push_back(
          {name, {distances[a], distances[a]}, {estimate.low, estimate.high}});
  }
  if (points.x.empty())
    return;
  panel.series.push_back(points);
  panel.series.insert(panel.series.end(), bars.begin(), bars.end());
}

Panel
differencePanel(const NoiseReport& report)
{
  Panel panel;
  panel.title = "Second differences, mean square / 6";
  panel.x = {"distance (px)", true};
  panel.y = {"variance (px^2)"};
  Series fitted{"fitted pattern", {}, {}, SeriesStyle::DashedLine};
  std::vector<Estimate> within, frames, poses;
  for (const PatternRow& row : report.pattern.rows) {
    fitted.x.push_back(row.distance_px);
    fitted.y.push_back(row.fitted);
    within.push_back(row.within_frame);
    frames.push_back(row.between_frames);
    poses.push_back(row.between_poses);
  }
  panel.series.push_back(fitted);
  addPoints(panel, "in a frame", fitted.x, within);
  addPoints(panel, "temporal", fitted.x, frames);
  addPoints(panel, "shared by poses", fitted.x, poses);
  return panel;
}

Panel
blockPanel(const NoiseReport& report)
{
  Panel panel;
  panel.title = "Covariance of blocks of 16 px about planes";
  panel.x = {"distance (px)"};
  panel.y = {"covariance (px^2)"};
  Series fitted{"fitted pattern", {}, {}, SeriesStyle::DashedLine};
  std::vector<Estimate> products;
  for (const DistantRow& row : report.pattern.distant) {
    fitted.x.push_back(row.distance_px);
    fitted.y.push_back(row.fitted);
    products.push_back(row.product);
  }
  panel.series.push_back(fitted);
  addPoints(panel, "in a frame", fitted.x, products);
  return panel;
}

} // namespace

Table
patternTable(const NoiseReport& report)
{
  Table table{{"pattern, px", "sigma", "95 % interval", "length", "95 % interval"}};
  const PatternCalibration& pattern = report.pattern;
  if (!isMeasured(report))
    return table;
  table.push_back({"a single point",
                   valueText(pattern.single),
                   intervalText(pattern.single),
                   "",
                   ""});
  table.push_back({"  white: independent",
                   valueText(pattern.white),
                   intervalText(pattern.white),
                   "",
                   ""});
  for (const WaveEstimate& wave : pattern.waves)
    table.push_back({"  shared by neighbours: " + shapeText(wave),
                     valueText(wave.sigma),
                     intervalText(wave.sigma),
                     valueText(wave.length),
                     intervalText(wave.length)});
  return table;
}

std::vector<std::string>
patternSentences(const NoiseReport& report)
{
  if (!isMeasured(report))
    return {"Without a plane it cannot be told what neighbouring pixels share."};
  std::vector<std::string> sentences;
  if (report.hasMap())
    sentences.push_back(patternMapSentence(report));
  if (!report.hasPattern()) {
    sentences.emplace_back(
        "Neighbouring pixels share nothing that is seen: their errors are "
        "independent.");
    return sentences;
  }
  sentences.push_back(poseSentence(report));
  if (hasCutOffWave(report))
    sentences.emplace_back("The long wave may be longer than the planes can tell: its "
                           "length is cut off, and it stands for all that is longer.");
  return sentences;
}

Json
patternJson(const NoiseReport& report)
{
  if (!isMeasured(report))
    return nullptr;
  const PatternCalibration& pattern = report.pattern;
  Json waves = Json::array(), differences = Json::array(), blocks = Json::array();
  for (const WaveEstimate& wave : pattern.waves)
    waves.push_back({{"sigma_px", estimateJson(wave.sigma)},
                     {"length_px", estimateJson(wave.length)},
                     {"shape", shapeText(wave)}});
  for (const PatternRow& row : pattern.rows)
    differences.push_back({{"distance_px", row.distance_px},
                           {"single_frame", estimateJson(row.within_frame)},
                           {"temporal", estimateJson(row.between_frames)},
                           {"between_poses", estimateJson(row.between_poses)},
                           {"fitted", row.fitted}});
  for (const DistantRow& row : pattern.distant)
    blocks.push_back({{"distance_px", row.distance_px},
                      {"single_frame", estimateJson(row.product)},
                      {"fitted", row.fitted}});
  return {{"poses", pattern.poses},
          {"single_point_px", estimateJson(pattern.single)},
          {"white_px", estimateJson(pattern.white)},
          {"waves", waves},
          {"shared_part", estimateJson(pattern.shared_part)},
          {"second_differences_px2", differences},
          {"block_covariances_px2", blocks}};
}

std::string
patternMapSentence(const NoiseReport& report)
{
  const PatternMapCalibration& map = report.map;
  if (!report.hasMap())
    return "";
  return fmt::format("The map of the fixed pattern knows {:.0f} % of the pixels. The "
                     "map of the other poses takes what the planes of one leave from "
                     "{:.3f} to {:.3f} px rms, the pixels seen by two or more; the "
                     "pattern is what is left then.",
                     100.0 * map.known_part,
                     map.before_px,
                     map.after_px);
}

Json
patternMapJson(const NoiseReport& report)
{
  if (!report.hasMap())
    return nullptr;
  const PatternMapCalibration& map = report.map;
  return {{"known_part", map.known_part},
          {"smoothing_px", map.smoothing_px},
          {"shrinkage", map.shrinkage},
          {"rms_before_px", map.before_px},
          {"rms_after_px", map.after_px}};
}

std::vector<Panel>
patternPanels(const NoiseReport& report)
{
  if (!isMeasured(report))
    return {};
  return {differencePanel(report), blockPanel(report)};
}

NoisePattern
roundedPattern(const NoiseReport& report)
{
  NoisePattern pattern = report.pattern.pattern();
  for (PatternWave& wave : pattern.waves) {
    wave.sigma = rounded(wave.sigma);
    wave.length_px = rounded(wave.length_px);
  }
  return pattern;
}

std::string
patternComment(const NoiseReport& report)
{
  std::string text = fmt::format("What neighbouring pixels share of it; white: {}.",
                                 valueAndInterval(report.pattern.white));
  for (const WaveEstimate& wave : report.pattern.waves)
    text += fmt::format(" {}: sigma {} over {} px.",
                        shapeText(wave),
                        valueAndInterval(wave.sigma),
                        valueAndInterval(wave.length));
  for (const std::string& sentence : patternSentences(report))
    text += " " + sentence;
  return text;
}

} // namespace holdfast::app
