// What many views of a spot tell, what their covariances claim, and the pose that
// patches tell.
#include "experiment.h"
#include "fusion_registration.h"
#include "fusion_trials.h"

#include <holdfast/io/config.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace holdfast::app {
namespace {

constexpr int kNoFading = 1 << 20; // more views than there are
constexpr const char* kModelError = "model error";
constexpr const char* kModelErrorFading = "model error, fading";

FusionRule
ruleOf(bool model_error, bool fading)
{
  FusionRule rule;
  rule.model_error = model_error;
  if (!fading)
    rule.map.max_views = kNoFading;
  if (model_error)
    rule.name = fading ? kModelErrorFading : kModelError;
  else
    rule.name = fading ? "fading" : "neither";
  return rule;
}

/// FUSION 2: supports that differ, on surfaces that are no quadrics.
std::vector<FusionCase>
supportCases()
{
  std::vector<FusionCase> cases;
  const auto add = [&](const char* name, double offset_m, double s3) {
    FusionCase& c = cases.emplace_back();
    c.part = "support";
    c.name = name;
    c.offset_m = offset_m;
    c.s3_per_m2 = s3;
    c.views = {1, 4, 16, 64};
    c.rules = {ruleOf(true, true),
               ruleOf(true, false),
               ruleOf(false, true),
               ruleOf(false, false)};
  };
  add("same support", 0.0, 0.0);
  add("within 1 cm, s3 0", 0.01, 0.0);
  add("within 1 cm, s3 30", 0.01, 30.0);
  add("within 0.5 cm, s3 100", 0.005, 100.0);
  add("within 3 cm, s3 100", 0.03, 100.0);
  return cases;
}

/// A sensor whose way is known by increments.
std::vector<FusionCase>
odometryCases()
{
  std::vector<FusionCase> cases;
  for (const double sigma : {0.5e-3, 2e-3}) {
    FusionCase& c = cases.emplace_back();
    c.part = "odometry";
    c.name = fmt::format("{0} mrad, {0} mm a view", 1e3 * sigma);
    c.odometry_sigma_rad = c.odometry_sigma_m = sigma;
    c.views = {1, 4, 16, 25};
    const auto add = [&](const char* name, PoseSource poses) {
      FusionRule rule = ruleOf(true, false);
      rule.name = name;
      rule.poses = poses;
      c.rules.push_back(rule);
    };
    add("robot-centric", PoseSource::Odometry);
    add("world, as if independent", PoseSource::OdometryWorld);
    add("as if exact", PoseSource::OdometryTaken);
  }
  return cases;
}

/// A camera that stands still, whose error is to a good part the same in each frame.
std::vector<FusionCase>
patternCases()
{
  // 70 % of the variance, which no two pixels share.
  const double sigma_px = std::sqrt(0.7) * 0.17;
  const NoisePattern white{{{sigma_px, 0.2, PatternShape::Gaussian}}};
  std::vector<FusionCase> cases;
  const auto add = [&](const char* name, const NoisePattern& pattern) {
    FusionCase& c = cases.emplace_back();
    c.part = "still camera";
    c.name = name;
    c.pattern = pattern;
    c.views = {1, 4, 10, 16, 30};
    Sensor sensor = independentKinect();
    sensor.pattern = pattern;
    FusionRule rule = ruleOf(true, true);
    rule.name = "epoch";
    rule.poses = PoseSource::Still;
    rule.map = mapOptionsFor(sensor);
    c.rules.push_back(rule);
    rule.name = "as if independent";
    rule.map.pattern.clear(); // each view has one of its own
    rule.map.max_depth_change = 1e-12;
    rule.map.max_views = kNoFading;
    c.rules.push_back(rule);
  };
  add("pattern white in space", white);
  add("pattern of the xtion", loadSensor("xtion").pattern);
  return cases;
}

Json
rowOf(const FusionCase& c,
      std::size_t rule,
      std::size_t at,
      const std::vector<std::vector<RuleOutcome>>& trials)
{
  ErrorComparison errors;
  Mean variance;
  int measured = 0, refused = 0;
  for (const std::vector<RuleOutcome>& trial : trials) {
    measured += trial[rule].measured;
    refused += trial[rule].refused;
    if (const auto& error = trial[rule].errors[at]) {
      errors.add(error->squared_in_sigmas, 6);
      variance.add(1e6 * error->height_variance_m2);
    }
  }
  Json row{{"part", c.part},
           {"case", c.name},
           {"rule", c.rules[rule].name},
           {"views", c.views[at]},
           {"counted", errors.count()}};
  errors.addTo(row);
  row["height_sigma_mm"] = variance.root();
  // Of all views of the case.
  row["gated"] = measured > 0 ? Json(static_cast<double>(refused) / measured) : Json();
  for (const char* key :
       {"rotation_mrad", "translation_mm", "open_directions", "pairs"})
    row[key] = Json();
  return row;
}

void
addRows(const FusionCase& c,
        const ExperimentSettings& settings,
        const Progress& progress,
        std::vector<Json>& rows)
{
  std::vector<std::vector<RuleOutcome>> trials(
      static_cast<std::size_t>(settings.trials));
  parallelFor(
      settings.trials,
      settings.threads,
      [&](int i, int) {
        std::mt19937_64 generator =
            trialGenerator(settings.seed, static_cast<std::uint64_t>(i));
        trials[static_cast<std::size_t>(i)] = fuseViews(c, generator);
      },
      progress);
  for (std::size_t rule = 0; rule < c.rules.size(); ++rule)
    for (std::size_t at = 0; at < c.views.size(); ++at)
      rows.push_back(rowOf(c, rule, at, trials));
}

struct RegistrationCase {
  RegistrationGround ground;
  const char* name;
  double guess_error; ///< rad and m
};
constexpr std::array<RegistrationCase, 4> kRegistrations{
    {{RegistrationGround::Gentle, "gentle ground, guess 10 mrad, 10 mm", 0.01},
     {RegistrationGround::Gentle, "gentle ground, guess 1 mrad, 1 mm", 0.001},
     {RegistrationGround::Rocks, "rocks, guess 10 mrad, 10 mm", 0.01},
     {RegistrationGround::Rocks, "rocks, guess 1 mrad, 1 mm", 0.001}}};

Json
rowOf(const RegistrationCase& c,
      const std::vector<std::optional<RegistrationError>>& trials)
{
  ErrorComparison errors;
  Mean rotation, translation, pairs, refused, open;
  for (const auto& trial : trials) {
    if (!trial)
      continue;
    const ObservedError& error = trial->error;
    errors.add(error.squared_in_sigmas, error.dof);
    rotation.add(1e6 * error.error.head<3>().squaredNorm() / 3.0);
    translation.add(1e6 * error.error.tail<3>().squaredNorm() / 3.0);
    open.add(6 - error.dof);
    pairs.add(trial->pairs);
    refused.add(static_cast<double>(trial->refused) / (trial->pairs + trial->refused));
  }
  Json row{{"part", "registration"},
           {"case", c.name},
           {"rule", "300 of 500 patches"},
           {"views", 1},
           {"counted", errors.count()}};
  errors.addTo(row);
  row["height_sigma_mm"] = Json();
  row["gated"] = refused.value();
  row["rotation_mrad"] = rotation.root();
  row["translation_mm"] = translation.root();
  row["open_directions"] = open.value();
  row["pairs"] = pairs.value();
  return row;
}

/// FUSION 5. They take long: there are a quarter as many as of the others.
void
addRegistrationRow(const RegistrationCase& c,
                   const ExperimentSettings& settings,
                   const Progress& progress,
                   std::vector<Json>& rows)
{
  const int count = std::max(2, settings.trials / 4);
  std::vector<std::optional<RegistrationError>> trials(static_cast<std::size_t>(count));
  parallelFor(
      count,
      settings.threads,
      [&](int i, int) {
        std::mt19937_64 generator =
            trialGenerator(settings.seed, static_cast<std::uint64_t>(i));
        trials[static_cast<std::size_t>(i)] =
            registerOnce(c.ground, c.guess_error, generator);
      },
      progress);
  rows.push_back(rowOf(c, trials));
}

/// One row for all numbers of views.
std::vector<Json>
summaryOf(const std::vector<Json>& rows)
{
  std::vector<Json> summary;
  for (const Json& row : rows) {
    const bool is_next = summary.empty() || summary.back()["case"] != row["case"] ||
                         summary.back()["rule"] != row["rule"];
    if (is_next)
      summary.emplace_back(Json::object());
    Json& line = summary.back();
    const Json first_sigma = is_next ? row["height_sigma_mm"] : line["first_sigma_mm"];
    line.update(row); // of the last number of views
    line["first_sigma_mm"] = first_sigma;
    line["nees_" + row["views"].dump()] = row["nees_per_dof"];
  }
  return summary;
}

/// What is drawn over the number of views: one line for each case.
Panel
panelOf(const std::vector<Json>& rows,
        const std::string& part,
        const std::string& rule,
        bool sigma)
{
  Panel panel;
  panel.title = (sigma ? "sigma, " : "NEES/dof, ") + rule;
  panel.x = {"views", true};
  panel.y = {sigma ? "sigma of the height (mm)" : "NEES/dof (1 is right)", true};
  for (const Json& row : rows) {
    if (row["part"] != part || row["rule"] != rule || row["nees_per_dof"].is_null())
      continue;
    const std::string name = row["case"];
    if (panel.series.empty() || panel.series.back().name != name)
      panel.series.push_back({name, {}, {}});
    Series& series = panel.series.back();
    const double value = row[sigma ? "height_sigma_mm" : "nees_per_dof"];
    const double error = sigma || row["nees_standard_error"].is_null() ?
                             0.0 :
                             3.0 * row["nees_standard_error"].get<double>();
    series.x.push_back(row["views"]);
    series.y.push_back(value);
    series.low.push_back(std::max(0.5 * value, value - error));
    series.high.push_back(value + error);
  }
  return panel;
}

void
describe(Report& report)
{
  report.columns = {{"case", "case"},
                    {"taken as", "rule"},
                    {"n = 1", "nees_1"},
                    {"4", "nees_4"},
                    {"10", "nees_10"},
                    {"16", "nees_16"},
                    {"views", "views"},
                    {"NEES/dof", "nees_per_dof"},
                    {"std. error", "nees_standard_error"},
                    {"inside 95 %", "coverage95"},
                    {"sigma 1 (mm)", "first_sigma_mm"},
                    {"sigma (mm)", "height_sigma_mm"},
                    {"gated", "gated"},
                    {"mrad", "rotation_mrad"},
                    {"mm", "translation_mm"},
                    {"open", "open_directions"}};
  report.remarks = {
      "A spot with curvatures -5 and -10 1/m, seen by a Kinect from 0.8 to 1.2 m and "
      "tilts of 0.2 to 0.8 rad, 140 points on a disc of 5 cm a view. NEES/dof is of "
      "the six numbers of the fused jet about the best quadric over the disc of the "
      "first view, after 1, 4, 10, 16 and as many views as stand in the column "
      "(a number of views' own row is in CSV and JSON); sigma is that of the height. "
      "Supports lie within so far of the first one's centre; s3 (1/m^2) is the root "
      "mean square third derivative. model error: what of the surface is no quadric "
      "counts where supports differ; fading: what was known counts less after sixteen "
      "views.",
      "odometry: of where the patch lies from the sensor, of the world's where poses "
      "are added up. still camera: an epoch is a time in which a spot is seen through "
      "the same pixels, whose shared error does not average.",
      "registration: a Kinect 1.3 m above 500 patches of 4 cm on 1.2 x 0.9 m, of which "
      "it sees 300 again, where they are by a guess of the pose. mrad and mm are root "
      "mean squares per axis of what is left, open the mean number of directions that "
      "the patches do not tell, which count nowhere."};
  report.plot.columns = 3;
  report.plot.panels = {panelOf(report.rows, "support", kModelError, true),
                        panelOf(report.rows, "support", kModelError, false),
                        panelOf(report.rows, "support", kModelErrorFading, false),
                        panelOf(report.rows, "support", "neither", false),
                        panelOf(report.rows, "odometry", "robot-centric", false),
                        panelOf(report.rows, "still camera", "epoch", false)};
}

Report
run(const ExperimentSettings& settings)
{
  std::vector<FusionCase> cases = supportCases();
  for (const auto& more : {odometryCases(), patternCases()})
    cases.insert(cases.end(), more.begin(), more.end());
  const int stages = static_cast<int>(cases.size() + kRegistrations.size());
  int stage = 0;
  Report report;
  const auto next = [&] { return stageProgress(settings.progress, stage++, stages); };
  for (const FusionCase& c : cases)
    addRows(c, settings, next(), report.rows);
  for (const RegistrationCase& c : kRegistrations)
    addRegistrationRow(c, settings, next(), report.rows);
  report.summary = summaryOf(report.rows);
  describe(report);
  return report;
}

} // namespace

Experiment
fusionExperiment()
{
  return {"fusion",
          "Patches from many views, and poses from patches, against their covariances",
          "Spots per case; a quarter as many registrations",
          200,
          [](CLI::App&) { return ExperimentRun(run); }};
}

} // namespace holdfast::app
