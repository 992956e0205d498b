// Are the covariances right? Every scene, type and mode against Monte Carlo.
#include "experiment.h"
#include "scene.h"

#include "command_line.h"

#include <holdfast/evaluation/consistency.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <memory>
#include <random>

namespace holdfast::app {
namespace {

// Tilt and azimuth of the robot scenes, rad.
constexpr double kTilt = 0.5, kAzimuth = 0.6;

const std::vector<std::string> kScenes{"table2",
                                       "robot-0.8",
                                       "robot-1.0",
                                       "robot-1.2",
                                       "random",
                                       "sweep"};

// Options by name: all departures from the paper, none, or all but one.
struct OptionSet {
  std::string name;
  FitOptions fit;
};

std::vector<OptionSet>
optionSets()
{
  std::vector<OptionSet> sets{{"default", {}}, {"paper", FitOptions::paper()}};
  const auto without = [&](const std::string& name, auto change) {
    sets.push_back({"without-" + name, {}});
    change(sets.back().fit);
  };
  without("ray", [](FitOptions& fit) { fit.residual = Residual::Sampson; });
  without("debias", [](FitOptions& fit) { fit.debias_scatter = false; });
  without("surface-noise", [](FitOptions& fit) { fit.noise_at_surface = false; });
  without("pca-normal", [](FitOptions& fit) { fit.normal_from_pca = false; });
  without("smooth-circle", [](FitOptions& fit) { fit.smooth_circle_radius = false; });
  return sets;
}

struct ConsistencyChoice {
  std::vector<std::string> types, modes, scenes, options;
  double noise_scale = 1.0;
};

std::string
typeName(PatchType type)
{
  const std::string surface(surfaceName(type.surface));
  return type.surface == SurfaceType::Plane ?
             surface + "_" + std::string(boundaryName(type.boundary)) :
             surface;
}

// "random": a distance, tilt and azimuth of its own for every type and seed.
ReferenceScene
sceneOf(const std::string& name, PatchType type, std::size_t index, std::uint64_t seed)
{
  if (name == "table2")
    return tableTwoScene(type);
  if (name != "random")
    return robotScene(type,
                      parseNumber<double>(name.substr(6)).value(),
                      kTilt,
                      kAzimuth);
  std::mt19937_64 generator = trialGenerator(seed, index);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(generator);
  };
  const double distance = uniform(0.8, 1.0), tilt = uniform(0.2, 0.8);
  return robotScene(type, distance, tilt, uniform(0.0, 6.283));
}

Json
byName(const std::vector<double>& values, PatchType type)
{
  Json json = Json::object();
  const std::vector<std::string> names = parameterNames(type);
  for (std::size_t i = 0; i < values.size(); ++i)
    json[names[i]] = values[i];
  return json;
}

double
largest(const std::vector<double>& values)
{
  double result = 0.0;
  for (const double value : values)
    result = std::max(result, std::abs(value));
  return result;
}

Json
columnsJson(const std::vector<ConsistencyColumn>& columns)
{
  Json json = Json::array();
  for (const ConsistencyColumn& column : columns)
    json.push_back(
        {{"up_to", std::isfinite(column.up_to) ? Json(column.up_to) : Json()},
         {"trials", column.trials},
         {"state_nees_per_dof", column.state_nees_per_dof},
         {"state_coverage95", column.state_coverage95},
         {"nees_per_dof", column.nees_per_dof}});
  return json;
}

Json
rowOf(const std::string& scene,
      PatchType type,
      CovarianceMode mode,
      const std::string& options,
      const ConsistencyResult& result)
{
  const auto range =
      std::minmax_element(result.sigma_ratio.begin(), result.sigma_ratio.end());
  const bool any = !result.sigma_ratio.empty();
  return {{"scene", scene},
          {"type", typeName(type)},
          {"mode", covarianceModeName(mode)},
          {"options", options},
          {"trials", result.trials},
          {"points", result.points},
          {"nees_per_dof", result.nees_per_dof},
          {"nees_per_dof_about_mean", result.nees_per_dof_about_mean},
          {"coverage95", result.coverage95},
          {"sigma_ratio_min", any ? Json(*range.first) : Json()},
          {"sigma_ratio_max", any ? Json(*range.second) : Json()},
          {"bias_after_shift_max", largest(result.bias_after_shift_sigma)},
          {"state_nees_per_dof", result.state_nees_per_dof},
          {"state_coverage95", result.state_coverage95},
          {"unflagged_nees_per_dof", result.unflagged_nees_per_dof},
          {"unflagged_rate", result.unflagged_rate},
          {"by_nonlinearity", columnsJson(result.by_nonlinearity)},
          {"type_error_rate",
           isParaboloid(type.surface) || (type.surface == SurfaceType::Plane &&
                                          type.boundary == BoundaryType::Ellipse) ?
               Json(result.type_error_rate) :
               Json()},
          {"sigma_ratio", byName(result.sigma_ratio, type)},
          {"bias_sigma", byName(result.bias_sigma, type)},
          {"bias_after_shift_sigma", byName(result.bias_after_shift_sigma, type)},
          {"switch_rate", result.switch_rate},
          {"failure_rate", result.failure_rate}};
}

bool
chosen(const std::vector<std::string>& choice, const std::string& name)
{
  return choice.empty() ||
         std::any_of(choice.begin(), choice.end(), [&name](const std::string& chosen) {
           return isSameName(chosen, name);
         });
}

// One row to compute.
struct Case {
  std::string scene;
  std::size_t type_index;
  CovarianceMode mode;
  OptionSet options;
};

// Without a choice: every scene and type with the default mode and options.
std::vector<Case>
casesOf(const ConsistencyChoice& choice)
{
  const std::vector<std::string> modes =
      choice.modes.empty() ? std::vector<std::string>{"exact"} : choice.modes;
  const std::vector<std::string> options =
      choice.options.empty() ? std::vector<std::string>{"default"} : choice.options;
  std::vector<Case> cases;
  for (const std::string& scene : kScenes)
    for (std::size_t type = 0; type < kPatchTypes.size(); ++type)
      for (const CovarianceMode mode : kAllCovarianceModes)
        for (const OptionSet& set : optionSets())
          if (chosen(choice.scenes, scene) &&
              chosen(choice.types, typeName(kPatchTypes[type])) &&
              chosen(modes, std::string(covarianceModeName(mode))) &&
              chosen(options, set.name))
            cases.push_back({scene, type, mode, set});
  return cases;
}

// Many views nobody chose, a few trials each. Views in which the points do not
// determine the patch even without noise are drawn again.
ConsistencyResult
sweep(PatchType type,
      std::size_t type_index,
      const NoiseModel& noise,
      const ConsistencyOptions& options)
{
  constexpr int kTrialsPerView = 20;
  std::mt19937_64 generator = trialGenerator(options.seed, type_index);
  std::vector<ConsistencyResult> views;
  const int wanted = std::max(1, options.trials / kTrialsPerView);
  while (static_cast<int>(views.size()) < wanted) {
    const ReferenceScene scene = randomScene(type, generator);
    ConsistencyOptions few = options;
    few.trials = kTrialsPerView;
    few.seed = generator();
    few.progress = nullptr;
    if (options.progress)
      options.progress(static_cast<int>(views.size()), wanted);
    try {
      views.push_back(checkConsistency(scene.scene, scene.rays, noise, few));
    }
    catch (const std::invalid_argument&) {
      continue;
    }
  }
  return pooled(views);
}

Report
runConsistency(const ConsistencyChoice& choice, const ExperimentSettings& settings)
{
  const std::vector<Case> cases = casesOf(choice);
  const NoiseModel::ConstPtr noise = kinectNoise();
  Report report;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& one = cases[i];
    const PatchType type = kPatchTypes[one.type_index];
    ConsistencyOptions options;
    options.fit = one.options.fit;
    options.mode = one.mode;
    options.trials = settings.trials;
    options.seed = settings.seed;
    options.threads = settings.threads;
    options.noise_scale = choice.noise_scale;
    options.count_type_errors = true;
    options.progress = stageProgress(settings.progress,
                                     static_cast<int>(i),
                                     static_cast<int>(cases.size()));
    const auto check = [&] {
      if (one.scene == "sweep")
        return sweep(type, one.type_index, *noise, options);
      const ReferenceScene scene =
          sceneOf(one.scene, type, one.type_index, settings.seed);
      return checkConsistency(scene.scene, scene.rays, *noise, options);
    };
    report.rows.push_back(rowOf(one.scene, type, one.mode, one.options.name, check()));
  }
  report.columns = {{"scene", "scene"},
                    {"type", "type"},
                    {"mode", "mode"},
                    {"options", "options"},
                    {"N", "points"},
                    {"state NEES/dof", "state_nees_per_dof"},
                    {"state 95 %", "state_coverage95"},
                    {"unflagged", "unflagged_nees_per_dof"},
                    {"share", "unflagged_rate"},
                    {"NEES/dof", "nees_per_dof"},
                    {"about mean", "nees_per_dof_about_mean"},
                    {"95 %", "coverage95"},
                    {"sigma min", "sigma_ratio_min"},
                    {"sigma max", "sigma_ratio_max"},
                    {"bias", "bias_after_shift_max"},
                    {"type errors", "type_error_rate"},
                    {"failures", "failure_rate"}};
  report.remarks = {
      "NEES/dof: squared error about the noise-free fit, normalised by the predicted "
      "covariance; 1 is right, and a Monte Carlo of this size gives it to about +-" +
      std::to_string(std::sqrt(2.0 / (7.0 * settings.trials))).substr(0, 5) +
      " (one sigma). 95 %: share within the predicted ellipsoid. sigma: predicted over "
      "empirical. bias: largest of any parameter in sigmas, second-order shift "
      "subtracted."};
  return report;
}

} // namespace

Experiment
consistencyExperiment()
{
  Experiment experiment;
  experiment.name = "consistency";
  experiment.former_name = "calibration";
  experiment.summary = "Predicted covariances against Monte Carlo on known scenes";
  experiment.trials_meaning = "noise draws per row";
  experiment.default_trials = 3000;
  experiment.prepare = [](CLI::App& command) -> ExperimentRun {
    const auto choice = std::make_shared<ConsistencyChoice>();
    std::vector<std::string> types, modes, options;
    for (const PatchType type : kPatchTypes)
      types.push_back(typeName(type));
    for (const CovarianceMode mode : kAllCovarianceModes)
      modes.push_back(std::string(covarianceModeName(mode)));
    for (const OptionSet& set : optionSets())
      options.push_back(set.name);
    const auto add = [&](const std::string& name,
                         std::vector<std::string>& values,
                         const std::vector<std::string>& allowed,
                         const std::string& description) {
      command.add_option(name, values, description)
          ->check(oneOf(allowed, [allowed](const std::string& word) {
            return chosen(allowed, word);
          }));
    };
    add("--type", choice->types, types, "Only these patch types");
    add("--mode", choice->modes, modes, "Covariance modes (default: exact)");
    add("--scene", choice->scenes, kScenes, "Only these scenes");
    add("--options", choice->options, options, "Option sets (default: default)");
    command.add_flag_callback(
        "--paper",
        [choice] { choice->options = {"paper"}; },
        "The paper's choices, as --options paper");
    command
        .add_option("--noise-scale",
                    choice->noise_scale,
                    "Factor on the noise's sigmas")
        ->check(CLI::PositiveNumber);
    return [choice](const ExperimentSettings& settings) {
      return runConsistency(*choice, settings);
    };
  };
  return experiment;
}

} // namespace holdfast::app
