#include "noise_report.h"

#include "command_line.h"
#include "console.h"
#include "estimate_text.h"
#include "pattern_report.h"

#include <holdfast/io/config.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace holdfast::app {
namespace {

using Json = nlohmann::ordered_json;
using Table = std::vector<std::vector<std::string>>;

double
focalTimesBaseline(const Sensor& sensor)
{
  return sensor.disparity_focal_px * sensor.baseline_m;
}

/// Of the nominal sensor, or that of a Kinect where it has none.
double
nominalSigmaPoint(const Sensor& sensor)
{
  const auto* stereo = dynamic_cast<const StereoNoiseModel*>(sensor.noise.get());
  const auto parameters =
      stereo != nullptr ? stereo->parameters() : StereoNoiseModel::Parameters{};
  return parameters.sigma_point_px;
}

/// "whole planes" or "squares of 64 px (8.2 cm)".
std::string
regionText(int size_px, const NoiseReport& report)
{
  if (size_px == 0)
    return "whole planes";
  const double size_m = size_px / report.sensor.camera.fx * report.found.mean_m;
  return fmt::format("squares of {} px ({:.1f} cm)", size_px, 100.0 * size_m);
}

std::string
framesText(int frames)
{
  return frames == 1 ? "1 frame" : fmt::format("{} frames", frames);
}

std::string
headText(const NoiseReport& report)
{
  const NoiseCalibration& found = report.found;
  const Sensor& sensor = report.sensor;
  const std::string planes = found.planes == 0 ? "small spots" :
                             found.planes == 1 ? "1 plane" :
                                                 fmt::format("{} planes", found.planes);
  return fmt::format("{} of {} x {}, sensor {}: disparity = {:.4g} px x {:.4g} m / "
                     "depth\n{} pixels of each are static and flat ({}), {:.2f} to "
                     "{:.2f} m away",
                     framesText(found.frames),
                     sensor.camera.width,
                     sensor.camera.height,
                     sensor.name,
                     sensor.disparity_focal_px,
                     sensor.baseline_m,
                     found.pixels,
                     planes,
                     found.min_m,
                     found.max_m);
}

Table
sigmaTable(const NoiseReport& report)
{
  const NoiseCalibration& found = report.found;
  Table table{
      {"disparity, px", "sigma", "95 % interval", "before rounding", "95 % interval"}};
  const auto row =
      [&table](const std::string& name, const Estimate& as_is, const Estimate& before) {
        table.push_back({name,
                         valueText(as_is),
                         intervalText(as_is),
                         valueText(before),
                         intervalText(before)});
      };
  row("in a frame, about " + regionText(found.region_px, report),
      found.sigmas.single,
      found.before_rounding.single);
  row("  temporal: from frame to frame",
      found.sigmas.temporal,
      found.before_rounding.temporal);
  row("  fixed pattern: mean of the frames",
      found.sigmas.fixed,
      found.before_rounding.fixed);
  row("  fixed pattern: by difference", found.fixed_from_difference, {});
  row("step of the values", found.quantum, {});
  row("across the rays", found.sigma_point, {});
  return table;
}

Table
sizeTable(const NoiseReport& report)
{
  Table table{
      {"in a frame, by size of region", "regions", "sigma px", "95 % interval"}};
  for (const RegionSizeRow& row : report.found.by_region_size)
    table.push_back({regionText(row.size_px, report),
                     std::to_string(row.regions),
                     valueText(row.single),
                     intervalText(row.single)});
  return table;
}

Table
depthTable(const NoiseReport& report)
{
  Table table{{"by depth, m",
               "pixels",
               "in a frame",
               "95 % interval",
               "temporal",
               "95 % interval",
               "fixed",
               "95 % interval"}};
  for (const DepthRow& row : report.found.by_depth) {
    std::vector<std::string>& cells = table.emplace_back();
    cells = {fmt::format("{:.2f} to {:.2f}", row.min_m, row.max_m),
             std::to_string(row.pixels)};
    for (const Estimate* sigma :
         {&row.sigmas.single, &row.sigmas.temporal, &row.sigmas.fixed}) {
      cells.push_back(valueText(*sigma));
      cells.push_back(intervalText(*sigma));
    }
  }
  return table;
}

/// A step is a power of two or the like of a px; a small difference belongs to f b.
std::string
stepSentence(const NoiseReport& report)
{
  const Estimate& step = report.found.quantum;
  if (!step.isKnown())
    return "No step is seen: the disparities take any value, or depths are rounded "
           "more coarsely.";
  const double parts = std::max(1.0, std::round(1.0 / step.value));
  const double ratio = step.value * parts;
  std::string text = "The disparities come in steps of " + digits(step.value) + " px";
  if (std::abs(ratio - 1.0) > 0.03)
    return text + ".";
  text += fmt::format(", 1/{:.0f} px", parts);
  // What four digits of f b cannot express is no difference.
  if (std::abs(ratio - 1.0) > 5e-4)
    text += fmt::format(" if focal length x baseline is {:.4g} px m and not {:.4g}",
                        focalTimesBaseline(report.sensor) / ratio,
                        focalTimesBaseline(report.sensor));
  return text + ".";
}

std::string
pointSentence(const NoiseReport& report)
{
  if (report.found.sigma_point.isKnown())
    return "The points scatter across the rays of their pixels; this is taken as their "
           "pointing error.";
  return fmt::format("The points lie exactly on the rays of their pixels, so that "
                     "nothing can be said about their pointing error: sigma_point_px "
                     "stays {:.3g}.",
                     nominalSigmaPoint(report.sensor));
}

/// At twice the depth the noise is the same within 7 %.
constexpr double kNegligibleExponent = 0.1;

std::string
depthSentence(const NoiseReport& report)
{
  const Estimate& exponent = report.found.depth_exponent;
  const std::string power =
      fmt::format("in a frame it goes with depth^p, p = {:.2f} ({:.2f} to {:.2f})",
                  exponent.value,
                  exponent.low,
                  exponent.high);
  if (!std::isfinite(exponent.low))
    return "Too little to tell whether the disparity noise depends on the depth.";
  if (std::max(std::abs(exponent.low), std::abs(exponent.high)) < kNegligibleExponent)
    return "The disparity noise is the same at all depths: " + power + ".";
  if (exponent.contains(0.0))
    return "No dependence of the disparity noise on the depth is seen: " + power + ".";
  return fmt::format("The disparity noise {} with the depth: {}. The model, which has "
                     "it constant, is right on average.",
                     exponent.value > 0.0 ? "grows" : "falls",
                     power);
}

/// Why small regions show less.
std::string
sizeSentence(const NoiseReport& report)
{
  if (report.found.planes == 0)
    return "There is no large plane: these are flat spots of curved surfaces, in which "
           "long waves of a fixed pattern do not show. Show the camera a wall, a table "
           "or the floor.";
  return "A small region takes the long waves of a fixed pattern into its plane. There "
         "they are an error of the plane that its residual does not show; the sigma "
         "about whole planes holds them too.";
}

std::vector<std::string>
sentences(const NoiseReport& report)
{
  const NoiseCalibration& found = report.found;
  std::vector<std::string> all;
  if (found.frames == 1)
    all.emplace_back("One frame: what changes with time and what stays cannot be told "
                     "apart.");
  else if (found.sigmas.fixed.high < found.fixed_from_difference.low ||
           found.sigmas.fixed.low > found.fixed_from_difference.high)
    all.emplace_back("The two values of the fixed pattern contradict each other: scene "
                     "or sensor moved, or the sensor was warming up.");
  all.push_back(sizeSentence(report));
  all.push_back(depthSentence(report));
  all.push_back(stepSentence(report));
  all.push_back(pointSentence(report));
  for (const std::string& sentence : patternSentences(report))
    all.push_back(sentence);
  return all;
}

Json
sigmasJson(const DisparitySigmas& sigmas)
{
  return {{"single_frame", estimateJson(sigmas.single)},
          {"temporal", estimateJson(sigmas.temporal)},
          {"fixed_pattern", estimateJson(sigmas.fixed)}};
}

/// One figure over the depth: points, and their intervals as vertical lines.
void
addSeries(Panel& panel,
          const std::string& name,
          const NoiseReport& report,
          Estimate DisparitySigmas::*sigma,
          double (*scale)(double depth, const Sensor& sensor))
{
  Series points{name, {}, {}, SeriesStyle::Markers};
  std::vector<Series> bars;
  for (const DepthRow& row : report.found.by_depth) {
    const Estimate& estimate = row.sigmas.*sigma;
    if (!estimate.isKnown())
      continue;
    const double factor = scale(row.mean_m, report.sensor);
    points.x.push_back(row.mean_m);
    points.y.push_back(factor * estimate.value);
    if (std::isfinite(estimate.low))
      bars.push_back({name,
                      {row.mean_m, row.mean_m},
                      {factor * estimate.low, factor * estimate.high}});
  }
  if (points.x.empty())
    return;
  panel.series.push_back(points);
  panel.series.insert(panel.series.end(), bars.begin(), bars.end());
}

double
disparityScale(double, const Sensor&)
{
  return 1.0;
}

/// sigma_z = z^2 / (f b) sigma_d, in mm.
double
depthScale(double depth, const Sensor& sensor)
{
  return 1e3 * depth * depth / focalTimesBaseline(sensor);
}

Panel
depthPanel(const NoiseReport& report,
           const std::string& title,
           const std::string& unit,
           double (*scale)(double depth, const Sensor& sensor))
{
  Panel panel;
  panel.title = title;
  panel.x = {"depth (m)"};
  panel.y = {"standard deviation (" + unit + ")"};
  const NoiseCalibration& found = report.found;
  Series model{"model", {}, {}, SeriesStyle::DashedLine};
  constexpr int kSteps = 40;
  for (int i = 0; i <= kSteps; ++i) {
    const double z = found.min_m + (found.max_m - found.min_m) * i / kSteps;
    model.x.push_back(z);
    model.y.push_back(scale(z, report.sensor) * found.sigmas.single.value);
  }
  panel.series.push_back(model);
  addSeries(panel, "in a frame", report, &DisparitySigmas::single, scale);
  addSeries(panel, "temporal", report, &DisparitySigmas::temporal, scale);
  return panel;
}

std::string
disparityComment(const NoiseReport& report)
{
  const NoiseCalibration& found = report.found;
  std::string text;
  if (report.hasPattern())
    text = fmt::format("Of a single point, white part and pattern: {}. ",
                       valueAndInterval(report.pattern.single));
  text += fmt::format("Scatter about {} within a frame, with the rounding: {}.",
                      regionText(found.region_px, report),
                      valueAndInterval(found.sigmas.single));
  if (found.before_rounding.single.isKnown())
    text += fmt::format(" Before rounding: {}.",
                        valueAndInterval(found.before_rounding.single));
  if (found.sigmas.temporal.isKnown())
    text += fmt::format(" Only {} of it changes from frame to frame, {} is a fixed "
                        "pattern.",
                        valueAndInterval(found.sigmas.temporal),
                        valueAndInterval(found.sigmas.fixed));
  return text + " " + depthSentence(report);
}

SensorComments
commentsOf(const NoiseReport& report)
{
  const NoiseCalibration& found = report.found;
  SensorComments comments;
  const std::string& sensor = report.sensor.name;
  comments[""] =
      fmt::format("Measured by `holdfast calibrate` in {}, {} pixels of each. "
                  "In brackets: 95 % intervals.",
                  framesText(found.frames),
                  found.pixels);
  comments["camera"] = fmt::format("Of sensor {} where its rays fit the points of the "
                                   "frames, else recovered from them.",
                                   sensor);
  comments["range"] = fmt::format("Of sensor {}; the frames held depths from {:.2f} to "
                                  "{:.2f} m.",
                                  sensor,
                                  found.min_m,
                                  found.max_m);
  comments["disparity"] = fmt::format("Baseline and focal length of sensor {}. {}",
                                      sensor,
                                      stepSentence(report));
  comments["noise.sigma_disparity_px"] = disparityComment(report);
  if (report.hasPattern())
    comments["noise.pattern"] = patternComment(report);
  if (report.hasMap() && !report.hasPattern()) // else said there
    comments["noise.pattern_map"] = patternMapSentence(report);
  comments["noise.sigma_point_px"] =
      found.sigma_point.isKnown() ? fmt::format("Scatter across the rays: {}.",
                                                valueAndInterval(found.sigma_point)) :
                                    pointSentence(report);
  return comments;
}

} // namespace

namespace {

/// \throw std::runtime_error for all but Ok.
void
requireOk(NoiseCalibrationStatus status, const std::string& frames)
{
  switch (status) {
  case NoiseCalibrationStatus::NothingStatic:
    throw std::runtime_error(
        frames +
        ": nothing rests in most of the frames; did the camera move? Frames from "
        "another place belong to a --pose of their own");
  case NoiseCalibrationStatus::NothingFlat:
    throw std::runtime_error(frames + ": nothing large and flat to measure on; show "
                                      "the camera a wall, a table or the "
                                      "floor");
  case NoiseCalibrationStatus::Ok:
    break;
  }
}

std::vector<PoseFrames>
imagesOf(const std::vector<std::vector<RangeCloud>>& poses)
{
  std::vector<PoseFrames> images;
  for (const std::vector<RangeCloud>& pose : poses) {
    PoseFrames& frames = images.emplace_back();
    for (const RangeCloud& cloud : pose)
      frames.push_back(toPointImage(cloud));
  }
  return images;
}

NoiseCalibrationOptions
optionsFor(const Sensor& sensor)
{
  NoiseCalibrationOptions options;
  options.camera = sensor.camera;
  options.baseline_m = sensor.baseline_m;
  options.focal_px = sensor.disparity_focal_px;
  return options;
}

/// As seen from the folder of the sensor file, so that both can move together.
std::string
mapNameFor(const std::string& sensor_path, const std::string& map_path)
{
  namespace fs = std::filesystem;
  if (map_path.empty())
    return "";
  return fs::proximate(fs::absolute(map_path), fs::absolute(sensor_path).parent_path())
      .string();
}

} // namespace

NoiseReport
measureNoise(const std::vector<std::vector<RangeCloud>>& poses,
             const Sensor& sensor,
             int region_px,
             const std::function<std::string(int pose)>& poseName)
{
  const std::vector<PoseFrames> images = imagesOf(poses);
  const PoseFrames& frames = images.front();
  NoiseCalibrationOptions options = optionsFor(sensor);
  options.region_px = region_px;
  NoiseReport report{calibrateNoise(frames, options), {}, {}, sensor};
  report.sensor.pattern_map.reset(); // the frames were not corrected by it
  report.sensor.camera.width = frames.front().width;
  report.sensor.camera.height = frames.front().height;
  requireOk(report.found.status, poseName(0));
  report.pattern = calibratePattern(images, options);
  if (report.pattern.pose > 0)
    requireOk(report.pattern.status, poseName(report.pattern.pose));
  return report;
}

void
measurePatternMap(const std::vector<std::vector<RangeCloud>>& poses,
                  NoiseReport& report)
{
  const NoiseCalibrationOptions options = optionsFor(report.sensor);
  report.map = calibratePatternMap(imagesOf(poses), options);
  if (!report.hasMap())
    throw std::runtime_error("no pixel saw a plane from two poses, so that no map of "
                             "the pattern can be made");
  const Estimate shared_part = report.pattern.shared_part;
  report.pattern = report.map.left;
  report.pattern.shared_part = shared_part;
  report.sensor.pattern_map = report.map.map;
}

std::string
noiseReportText(const NoiseReport& report)
{
  std::string text = fmt::format("{}\n\n{}\n{}\n{}\n{}\n",
                                 headText(report),
                                 formatTable(sigmaTable(report)),
                                 formatTable(patternTable(report)),
                                 formatTable(sizeTable(report)),
                                 formatTable(depthTable(report)));
  for (const std::string& sentence : sentences(report))
    text += sentence + "\n";
  return text;
}

Json
noiseReportJson(const NoiseReport& report)
{
  const NoiseCalibration& found = report.found;
  Json sizes = Json::array(), depths = Json::array();
  for (const RegionSizeRow& row : found.by_region_size)
    sizes.push_back({{"size_px", row.size_px == 0 ? Json() : Json(row.size_px)},
                     {"regions", row.regions},
                     {"single_frame", estimateJson(row.single)}});
  for (const DepthRow& row : found.by_depth) {
    Json json = {{"min_m", row.min_m},
                 {"max_m", row.max_m},
                 {"mean_m", row.mean_m},
                 {"pixels", row.pixels}};
    json.update(sigmasJson(row.sigmas));
    depths.push_back(json);
  }
  return {{"sensor", report.sensor.name},
          {"focal_px", report.sensor.disparity_focal_px},
          {"baseline_m", report.sensor.baseline_m},
          {"frames", found.frames},
          {"pixels", found.pixels},
          {"planes", found.planes},
          {"region_px", found.region_px == 0 ? Json() : Json(found.region_px)},
          {"depth_range_m", {found.min_m, found.max_m}},
          {"sigma_disparity_px", sigmasJson(found.sigmas)},
          {"before_rounding_px", sigmasJson(found.before_rounding)},
          {"fixed_pattern_by_difference_px", estimateJson(found.fixed_from_difference)},
          {"quantum_px", estimateJson(found.quantum)},
          {"sigma_point_px", estimateJson(found.sigma_point)},
          {"depth_exponent", estimateJson(found.depth_exponent)},
          {"pattern", patternJson(report)},
          {"pattern_map", patternMapJson(report)},
          {"by_region_size", sizes},
          {"by_depth", depths},
          {"remarks", sentences(report)}};
}

Plot
noiseReportPlot(const NoiseReport& report)
{
  Plot plot{{depthPanel(report, "Disparity, with 95 % intervals", "px", disparityScale),
             depthPanel(report, "The same as depth", "mm", depthScale)},
            2};
  for (const Panel& panel : patternPanels(report))
    plot.panels.push_back(panel);
  return plot;
}

void
saveCalibratedSensor(const std::string& path,
                     const NoiseReport& report,
                     const std::string& map_path)
{
  const NoiseCalibration& found = report.found;
  Sensor sensor = report.sensor;
  StereoNoiseModel::Parameters noise;
  sensor.pattern = roundedPattern(report);
  noise.sigma_disparity_px =
      rounded((report.hasPattern() || report.hasMap() ? report.pattern.single :
                                                        found.sigmas.single)
                  .value);
  // Rounding must not make the whole less than its part.
  noise.sigma_disparity_px =
      std::max(noise.sigma_disparity_px, std::sqrt(sensor.pattern.variance()));
  noise.sigma_point_px = found.sigma_point.isKnown() ?
                             rounded(found.sigma_point.value) :
                             nominalSigmaPoint(report.sensor);
  noise.baseline_m = report.sensor.baseline_m;
  noise.focal_px = report.sensor.disparity_focal_px;
  sensor.name = std::filesystem::path(path).stem().string();
  sensor.disparity_quantum_px =
      found.quantum.isKnown() ? rounded(found.quantum.value) : 0.0;
  sensor.noise = std::make_shared<const StereoNoiseModel>(noise);
  saveSensor(path,
             sensor,
             {{"sigma_disparity_px", noise.sigma_disparity_px},
              {"sigma_point_px", noise.sigma_point_px},
              {"baseline_m", noise.baseline_m},
              {"focal_px", noise.focal_px}},
             commentsOf(report),
             mapNameFor(path, map_path));
}

} // namespace holdfast::app
