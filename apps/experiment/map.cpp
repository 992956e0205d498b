// Maps of patches from walks through simulated scenes, against the truth.
#include "experiment.h"
#include "input_options.h"
#include "map_stills.h"
#include "map_walk.h"
#include "spots.h"
#include "walk_options.h"

#include <CLI/CLI.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace holdfast::app {
namespace {

struct MapChoice {
  WalkChoice walk{{"boulder_field", "stairway"}, 101};
  double odometry_mrad = 1.0, odometry_mm = 2.0;
  std::string recorded; ///< folder; empty: walks
};

const std::vector<WalkRule>&
rules()
{
  static const std::vector<WalkRule> all{
      {"known poses", WalkPoses::Known, false},
      {"odometry", WalkPoses::Odometry, false},
      {"registration", WalkPoses::Registration, false},
      {"registration, pattern", WalkPoses::Registration, true}};
  return all;
}

/// Patches whose true surface leaves the best quadric by more, root mean square, are
/// over an edge.
constexpr double kEdge = 2e-3;
/// As elsewhere: one of these would be the mean.
constexpr double kFar = 100.0; // NEES/dof

/// Which patches a row is of.
struct Group {
  std::string name;
  int least_views = 1, most_views = 1 << 20;
  double least_residual_m = 0.0, most_residual_m = kEdge;
  double least_slope_sigma = 0.0, most_slope_sigma = 1e9;
};

/// What is less sure than a tenth of a radian, no first order holds for.
Group
bySlope(const char* name, double least, double most)
{
  Group group;
  group.name = name;
  group.least_slope_sigma = least;
  group.most_slope_sigma = most;
  return group;
}

const std::vector<Group>&
groups()
{
  constexpr int kMany = 1 << 20;
  static const std::vector<Group> all{{"1 view", 1, 1},
                                      {"2-3 views", 2, 3},
                                      {"4-7 views", 4, 7},
                                      {"8-15 views", 8, 15},
                                      {"16 or more", 16, kMany},
                                      {"smooth to 0.3 mm", 2, kMany, 0.0, 0.3e-3},
                                      {"0.3 to 1 mm", 2, kMany, 0.3e-3, 1e-3},
                                      {"1 to 2 mm", 2, kMany, 1e-3, kEdge},
                                      {"over an edge", 2, kMany, kEdge, 1e9},
                                      bySlope("slope sigma < 0.01", 0.0, 0.01),
                                      bySlope("0.01 to 0.03", 0.01, 0.03),
                                      bySlope("0.03 to 0.1", 0.03, 0.1),
                                      bySlope("above 0.1", 0.1, 1e9),
                                      {"all", 1, kMany}};
  return all;
}
constexpr std::size_t kByViews = 5; // of them, the first

bool
isIn(const Group& group, const MapPatchError& patch)
{
  return patch.residual_m && patch.views >= group.least_views &&
         patch.views <= group.most_views &&
         *patch.residual_m >= group.least_residual_m &&
         *patch.residual_m < group.most_residual_m &&
         patch.slope_sigma >= group.least_slope_sigma &&
         patch.slope_sigma < group.most_slope_sigma;
}

Json
medianOf(std::vector<double> values)
{
  if (values.empty())
    return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The median over that of chi-square: what few that are far off do not show in.
Json
medianRatio(const std::vector<double>& squared, int dof)
{
  const Json median = medianOf(squared);
  return median.is_null() ?
             median :
             Json(median.get<double>() /
                  boost::math::quantile(boost::math::chi_squared(dof), 0.5));
}

/// Everything a row may have, in the order of the files.
Json
emptyRow(const std::string& scene, const std::string& rule, const std::string& group)
{
  Json row{{"scene", scene}, {"poses", rule}, {"of", group}};
  for (const char* key : {"patches",
                          "far",
                          "height_nees",
                          "normal_nees",
                          "curvature_nees",
                          "nees_per_dof",
                          "nees_standard_error",
                          "coverage95",
                          "median_ratio",
                          "height_sigma_mm",
                          "single_sigma_mm",
                          "fall",
                          "frames",
                          "over_edge",
                          "drift",
                          "rotation_mrad",
                          "translation_mm",
                          "increment_nees",
                          "increment_coverage95",
                          "lost",
                          "open",
                          "gated",
                          "uncertain",
                          "ms_frame",
                          "ms_update"})
    row[key] = Json();
  return row;
}

void
addPatches(const Group& group, const std::vector<MapPatchError>& patches, Json& row)
{
  Mean height, normal, curvature;
  ErrorComparison all;
  std::vector<double> squared, sigmas, singles;
  int far = 0;
  for (const MapPatchError& patch : patches) {
    if (!isIn(group, patch))
      continue;
    squared.push_back(patch.all);
    sigmas.push_back(1e3 * patch.height_sigma_m);
    singles.push_back(1e3 * patch.first_height_sigma_m);
    if (patch.all > 6.0 * kFar) {
      ++far;
      continue;
    }
    height.add(patch.height);
    normal.add(patch.normal / 2.0);
    curvature.add(patch.curvature / 3.0);
    all.add(patch.all, 6);
  }
  row["patches"] = squared.size();
  row["far"] = far;
  row["height_nees"] = height.value();
  row["normal_nees"] = normal.value();
  row["curvature_nees"] = curvature.value();
  all.addTo(row);
  row["median_ratio"] = medianRatio(squared, 6);
  row["height_sigma_mm"] = medianOf(sigmas);
  row["single_sigma_mm"] = medianOf(singles);
  if (!squared.empty())
    row["fall"] =
        row["single_sigma_mm"].get<double>() / row["height_sigma_mm"].get<double>();
}

int
measurementsOf(const UpdateReport& u)
{
  return u.fused + u.born + u.gated + u.replaced + u.surplus + u.uncertain + u.unfit;
}

/// What the frames of all walks say, for the row of all patches.
void
addFrames(const std::vector<WalkOutcome>& walks, Json& row)
{
  Mean drift, rotation, translation, milliseconds, update;
  ErrorComparison increments;
  int lost = 0, open = 0, gated = 0, taken = 0, edges = 0, patches = 0, frames = 0;
  int uncertain = 0, measured = 0;
  for (const WalkOutcome& walk : walks) {
    frames += static_cast<int>(walk.frames.size());
    if (walk.frames.empty())
      continue;
    const WalkFrame& last = walk.frames.back();
    if (last.way_m > 0.0)
      drift.add(last.position_error_m / last.way_m);
    for (const WalkFrame& frame : walk.frames) {
      milliseconds.add(frame.milliseconds);
      if (frame.update_milliseconds)
        update.add(*frame.update_milliseconds);
      lost += frame.is_lost ? 1 : 0;
      open += frame.is_open ? 1 : 0;
      gated += frame.update.gated + frame.update.replaced;
      taken += frame.update.fused;
      uncertain += frame.update.uncertain;
      measured += measurementsOf(frame.update);
      if (frame.squared_rad) {
        rotation.add(1e6 * *frame.squared_rad);
        translation.add(1e6 * *frame.squared_m);
      }
      if (frame.observed)
        increments.add(frame.observed->squared_in_sigmas, frame.observed->dof);
    }
    for (const MapPatchError& patch : walk.patches) {
      ++patches;
      edges += !patch.residual_m || *patch.residual_m >= kEdge ? 1 : 0;
    }
  }
  row["over_edge"] = patches > 0 ? Json(static_cast<double>(edges) / patches) : Json();
  row["frames"] = frames;
  row["drift"] = drift.value();
  row["rotation_mrad"] = rotation.root();
  row["translation_mm"] = translation.root();
  Json of_increments;
  increments.addTo(of_increments);
  row["increment_nees"] = of_increments["nees_per_dof"];
  row["increment_coverage95"] = of_increments["coverage95"];
  row["lost"] = lost;
  row["open"] = open;
  row["gated"] =
      gated + taken > 0 ? Json(static_cast<double>(gated) / (gated + taken)) : Json();
  row["uncertain"] =
      measured > 0 ? Json(static_cast<double>(uncertain) / measured) : Json();
  row["ms_frame"] = milliseconds.value();
  row["ms_update"] = update.value();
}

/// \param walks of one rule
void
addRows(const std::string& scene,
        const std::string& rule,
        const std::vector<WalkOutcome>& walks,
        std::vector<Json>& rows)
{
  std::vector<MapPatchError> patches;
  for (const WalkOutcome& walk : walks)
    patches.insert(patches.end(), walk.patches.begin(), walk.patches.end());
  for (const Group& group : groups()) {
    Json row = emptyRow(scene, rule, group.name);
    addPatches(group, patches, row);
    if (&group == &groups().back())
      addFrames(walks, row);
    rows.push_back(row);
  }
}

/// What is printed.
std::vector<Json>
rowsShown(const std::vector<Json>& rows)
{
  std::vector<Json> shown;
  for (const Json& row : rows)
    for (const char* name : {"1 view", "4-7 views", "16 or more", "all"})
      if (row["of"] == name)
        shown.push_back(row);
  return shown;
}

Series
driftOf(const std::string& name, const WalkOutcome& walk)
{
  Series series{name, {}, {}};
  for (const WalkFrame& frame : walk.frames) {
    series.x.push_back(frame.way_m);
    series.y.push_back(1e3 * frame.position_error_m);
  }
  return series;
}

/// Over the number of views, one line for each way to get poses.
Panel
viewsPanel(const std::vector<Json>& rows,
           const std::string& scene,
           const std::string& key,
           const std::string& label,
           bool logarithmic)
{
  Panel panel;
  panel.title = scene;
  panel.x.label = "views";
  panel.x.categories = {"1", "2-3", "4-7", "8-15", "16+"};
  panel.y = {label, logarithmic};
  for (const WalkRule& rule : rules()) {
    Series series{rule.name, {}, {}};
    for (std::size_t i = 0; i < kByViews; ++i)
      for (const Json& row : rows)
        if (row["scene"] == scene && row["poses"] == rule.name &&
            row["of"] == groups()[i].name && !row[key].is_null()) {
          series.x.push_back(static_cast<double>(i));
          series.y.push_back(row[key]);
        }
    panel.series.push_back(series);
  }
  return panel;
}

void
describe(const MapChoice& choice, Report& report)
{
  report.columns = {{"scene", "scene"},
                    {"poses", "poses"},
                    {"of", "of"},
                    {"patches", "patches"},
                    {"far", "far"},
                    {"height", "height_nees"},
                    {"normal", "normal_nees"},
                    {"curvature", "curvature_nees"},
                    {"all", "nees_per_dof"},
                    {"median", "median_ratio"},
                    {"inside 95 %", "coverage95"},
                    {"sigma (mm)", "height_sigma_mm"},
                    {"of one view", "single_sigma_mm"},
                    {"fall", "fall"},
                    {"edges", "over_edge"},
                    {"frames", "frames"},
                    {"drift", "drift"},
                    {"mrad", "rotation_mrad"},
                    {"mm", "translation_mm"},
                    {"NEES/dof", "increment_nees"},
                    {"lost", "lost"},
                    {"open", "open"},
                    {"gated", "gated"},
                    {"uncertain", "uncertain"},
                    {"ms/frame", "ms_frame"},
                    {"ms/update", "ms_update"}};
  const std::vector<std::string> failures = report.remarks;
  report.remarks = {
      fmt::format(
          "A camera 1.2 m above the ground walks {:.3g} m in {} frames, every "
          "{} pixels counting; the map is made of what it sees. Poses are "
          "known, of odometry with {} mrad and {} mm a frame and axis, or found "
          "by registration to the map alone; noise is independent or, with the "
          "pattern, shared by pixels and the same in all frames.",
          choice.walk.step_m * (choice.walk.frames - 1),
          choice.walk.frames,
          choice.walk.stride,
          choice.odometry_mrad,
          choice.odometry_mm),
      "Each patch of the last map, as it was when it was last seen, against the best "
      "quadric of the scene over its disc where it lies from the true sensor: NEES/dof "
      "of the height, the slopes, the curvatures and all six, without those above 100 "
      "(far); the median over that of chi-square; the height's median sigma, and that "
      "after the first view of the same patches. Rows by views leave out patches over "
      "an edge, whose true surface is more than 2 mm (root mean square) off the best "
      "quadric; so do those by how far it is off, 0.3 to 2 mm, of patches seen twice "
      "or "
      "more.",
      "edges: share of the patches over one, or over the end of the scene; drift: "
      "distance of the last pose from the truth over the way; mrad, mm, NEES/dof: of "
      "the increments that registration found, root mean squares per axis; lost: "
      "frames "
      "without a pose, open: with a direction that patches do not tell; gated: share "
      "of "
      "the measurements that the map refused; uncertain: share of all that are too "
      "uncertain for it; ms/update: of the map alone."};
  report.remarks.insert(report.remarks.end(), failures.begin(), failures.end());
}

void
addPlot(const MapChoice& choice,
        const std::vector<std::vector<WalkOutcome>>& first_walks,
        Report& report)
{
  report.plot.columns = 3;
  for (std::size_t i = 0; i < choice.walk.scenes.size(); ++i) {
    const std::string& scene = choice.walk.scenes[i];
    Panel drift;
    drift.title = scene;
    drift.x.label = "way (m)";
    drift.y.label = "error of the position (mm)";
    for (std::size_t rule = 1; rule < rules().size(); ++rule)
      drift.series.push_back(driftOf(rules()[rule].name, first_walks[i][rule]));
    report.plot.panels.push_back(drift);
    report.plot.panels.push_back(
        viewsPanel(report.rows, scene, "nees_per_dof", "NEES/dof (1 is right)", true));
    report.plot.panels.push_back(viewsPanel(report.rows,
                                            scene,
                                            "height_sigma_mm",
                                            "sigma of the height (mm)",
                                            true));
  }
}

/// Of a camera that stood still, about the plane before it.
Report
runStills(const MapChoice& choice, const ExperimentSettings& settings)
{
  static const std::vector<StillRule> all_rules{
      {"still, first frame", true, true},
      {"still", false, true},
      {"still, as if independent", false, false}};
  Report report;
  describe(choice, report);
  report.remarks = {
      "Frames that a camera recorded from one pose, fused without motion. Each patch "
      "of "
      "the map that lies on the largest plane, about the mean of that plane over the "
      "frames: NEES/dof of the height, the slopes, the curvatures and all six. The "
      "pattern of a pose is estimated from the frames of the other poses; as if "
      "independent: without it. What the whole plane is bent counts as an error here."};
  RecordingOptions recordings;
  recordings.folder = choice.recorded;
  recordings.sensor_name = choice.walk.sensor;
  const auto outcomes =
      mapStills(recordings, all_rules, settings.threads, settings.seed, report.remarks);
  for (std::size_t rule = 0; rule < all_rules.size(); ++rule)
    for (const StillOutcome& still : outcomes[rule])
      addRows(still.scene, all_rules[rule].name, {still.map}, report.rows);
  report.summary = rowsShown(report.rows);
  return report;
}

Report
runMap(const MapChoice& choice, const ExperimentSettings& settings)
{
  Report report;
  std::vector<std::vector<WalkOutcome>> first_walks;
  const int stages = static_cast<int>(choice.walk.scenes.size()) * settings.trials;
  int stage = 0;
  for (const std::string& scene : choice.walk.scenes) {
    std::vector<std::vector<WalkOutcome>> by_rule(rules().size());
    for (int trial = 0; trial < settings.trials; ++trial) {
      WalkSettings walk;
      walk.scene = scene;
      walk.frames = choice.walk.frames;
      walk.step_m = choice.walk.step_m;
      walk.stride = choice.walk.stride;
      walk.sensor = loadSensorOption(choice.walk.sensor);
      walk.odometry_sigma_rad = 1e-3 * choice.odometry_mrad;
      walk.odometry_sigma_m = 1e-3 * choice.odometry_mm;
      walk.seed = settings.seed + static_cast<std::uint64_t>(trial);
      walk.threads = settings.threads;
      walk.progress = stageProgress(settings.progress, stage++, stages);
      std::vector<WalkOutcome> outcomes = walkThrough(walk, rules());
      for (std::size_t i = 0; i < outcomes.size(); ++i)
        if (!outcomes[i].failure.empty())
          report.remarks.push_back(fmt::format("{}, {}: ended at frame {}: {}",
                                               scene,
                                               rules()[i].name,
                                               outcomes[i].frames.size(),
                                               outcomes[i].failure));
      if (trial == 0)
        first_walks.push_back(outcomes);
      for (std::size_t i = 0; i < outcomes.size(); ++i)
        by_rule[i].push_back(std::move(outcomes[i]));
    }
    for (std::size_t i = 0; i < by_rule.size(); ++i)
      addRows(scene, rules()[i].name, by_rule[i], report.rows);
  }
  report.summary = rowsShown(report.rows);
  describe(choice, report);
  addPlot(choice, first_walks, report);
  return report;
}

void
addChoices(CLI::App& command, MapChoice& choice)
{
  addWalkOptions(command, choice.walk);
  command
      .add_option("--odometry-mrad",
                  choice.odometry_mrad,
                  "Error of an odometry's turn per frame and axis, mrad")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option("--odometry-mm",
                  choice.odometry_mm,
                  "Error of its way per frame and axis, mm")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option(
          "--recorded",
          choice.recorded,
          "In place of walks the frames mosd_*.pcd there that a camera recorded "
          "from one pose, about the table before it")
      ->type_name("FOLDER")
      ->check(CLI::ExistingDirectory);
}

} // namespace

Experiment
mapExperiment()
{
  Experiment experiment;
  experiment.name = "map";
  experiment.summary =
      "Maps of patches from simulated walks, or of a recorded table, against the truth";
  experiment.trials_meaning = "walks through each scene, whose noise differs";
  experiment.default_trials = 1;
  experiment.fewest_trials = 1;
  experiment.prepare = [](CLI::App& command) -> ExperimentRun {
    const auto choice = std::make_shared<MapChoice>();
    addChoices(command, *choice);
    return [choice](const ExperimentSettings& settings) {
      return choice->recorded.empty() ? runMap(*choice, settings) :
                                        runStills(*choice, settings);
    };
  };
  return experiment;
}

} // namespace holdfast::app
