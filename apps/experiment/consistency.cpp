// Are the covariances right? Every scene, type and mode against Monte Carlo.
#include "cloud_limits.h"
#include "consistency_rows.h"
#include "experiment.h"
#include "scene.h"
#include "whole_cloud.h"

#include "command_line.h"
#include "input_options.h"

#include <holdfast/evaluation/consistency.h>
#include <holdfast/io/config.h>
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
                                       "sweep",
                                       "sweep-1.0"};

// Whole frames, of all that is in them; only where asked for by name.
const std::vector<std::string> kClouds{"rocks", "table", "stairs", "mix"};
const std::vector<double> kCloudRadii_m{0.03, 0.05, 0.08};
constexpr int kTrialsPerFrame = 100;

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
  std::string sensor; // empty: the paper's Kinect
  bool no_pattern = false;
  bool by_limits = false;
};

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

bool
chosen(const std::vector<std::string>& choice, const std::string& name)
{
  return choice.empty() ||
         std::any_of(choice.begin(), choice.end(), [&name](const std::string& chosen) {
           return isSameName(chosen, name);
         });
}

// Without a choice only the default is.
bool
isWanted(const std::vector<std::string>& choice,
         const std::string& by_default,
         const std::string& name)
{
  return choice.empty() ? name == by_default : chosen(choice, name);
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
  std::vector<Case> cases;
  for (const std::string& scene : kScenes)
    for (std::size_t type = 0; type < kPatchTypes.size(); ++type)
      for (const CovarianceMode mode : kAllCovarianceModes)
        for (const OptionSet& set : optionSets())
          if (chosen(choice.scenes, scene) &&
              chosen(choice.types, typeName(kPatchTypes[type])) &&
              isWanted(choice.modes, "exact", std::string(covarianceModeName(mode))) &&
              isWanted(choice.options, "default", set.name))
            cases.push_back({scene, type, mode, set});
  return cases;
}

// Whole clouds, whose types are what is in them.
std::vector<Case>
cloudCasesOf(const ConsistencyChoice& choice)
{
  std::vector<Case> cases;
  if (choice.scenes.empty())
    return cases;
  for (const std::string& scene : kClouds)
    for (const CovarianceMode mode : kAllCovarianceModes)
      for (const OptionSet& set : optionSets())
        if (chosen(choice.scenes, scene) &&
            isWanted(choice.modes, "exact", std::string(covarianceModeName(mode))) &&
            isWanted(choice.options, "default", set.name))
          cases.push_back({scene, 0, mode, set});
  return cases;
}

bool
isSweep(const std::string& scene)
{
  return scene.rfind("sweep", 0) == 0;
}

// Many views nobody chose, a few trials each. Views in which the points do not
// determine the patch even without noise are drawn again.
ConsistencyResult
sweep(const std::string& name,
      std::size_t type_index,
      const Sensor& sensor,
      const ConsistencyOptions& options)
{
  const PatchType type = kPatchTypes[type_index];
  constexpr int kTrialsPerView = 20;
  std::mt19937_64 generator = trialGenerator(options.seed, type_index);
  std::vector<ConsistencyResult> views;
  const int wanted = std::max(1, options.trials / kTrialsPerView);
  while (static_cast<int>(views.size()) < wanted) {
    const ReferenceScene scene = name == "sweep" ? randomScene(type, generator) :
                                                   randomCloseScene(type, generator);
    ConsistencyOptions few = options;
    few.trials = kTrialsPerView;
    few.seed = generator();
    few.progress = nullptr;
    if (options.progress)
      options.progress(static_cast<int>(views.size()), wanted);
    try {
      views.push_back(checkConsistency(scene.scene, scene.rays, sensor, few));
    }
    catch (const std::invalid_argument&) {
      continue;
    }
  }
  return pooled(views);
}

// Of the scenes that show one patch, whose views are those of the reference camera.
Sensor
patchSensor(const ConsistencyChoice& choice)
{
  Sensor sensor;
  sensor.name = "kinect";
  sensor.noise = kinectNoise();
  if (!choice.sensor.empty())
    sensor = loadSensorOption(choice.sensor);
  sensor = withCamera(sensor, referenceCamera());
  return choice.no_pattern ? withoutPattern(sensor) : sensor;
}

// The same with a camera of its own.
Sensor
cloudSensor(const ConsistencyChoice& choice)
{
  if (choice.sensor.empty())
    return patchSensor(choice);
  const Sensor sensor = loadSensorOption(choice.sensor);
  return choice.no_pattern ? withoutPattern(sensor) : sensor;
}

ConsistencyResult
checkCase(const Case& one,
          const ConsistencyChoice& choice,
          const ExperimentSettings& settings)
{
  ConsistencyOptions options;
  options.fit = one.options.fit;
  options.mode = one.mode;
  options.trials = settings.trials;
  options.seed = settings.seed;
  options.threads = settings.threads;
  options.noise_scale = choice.noise_scale;
  options.count_type_errors = true;
  options.progress = settings.progress;
  const Sensor sensor = patchSensor(choice);
  if (isSweep(one.scene))
    return sweep(one.scene, one.type_index, sensor, options);
  const ReferenceScene scene =
      sceneOf(one.scene, kPatchTypes[one.type_index], one.type_index, settings.seed);
  return checkConsistency(scene.scene, scene.rays, sensor, options);
}

void
addPatchRows(const std::vector<Case>& cases,
             const ConsistencyChoice& choice,
             const ExperimentSettings& settings,
             Report& report)
{
  if (cases.empty())
    return;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& one = cases[i];
    ExperimentSettings stage = settings;
    stage.progress = stageProgress(settings.progress,
                                   static_cast<int>(i),
                                   static_cast<int>(cases.size()));
    const ConsistencyResult result = checkCase(one, choice, stage);
    const CaseName name{one.scene,
                        typeName(kPatchTypes[one.type_index]),
                        std::string(covarianceModeName(one.mode)),
                        one.options.name};
    report.rows.push_back(rowOf(name, kPatchTypes[one.type_index], result));
    if (isSweep(one.scene))
      for (const std::string& remark : columnRemarks(name, result))
        report.remarks.push_back(remark);
  }
  describePatches(settings.trials, !patchSensor(choice).pattern.empty(), report);
}

Json
cloudRow(const std::string& scene, const Case& one, const Json& measured)
{
  Json row = {{"scene", scene},
              {"type", measured["type"]},
              {"mode", covarianceModeName(one.mode)},
              {"options", one.options.name}};
  row.update(measured);
  return row;
}

void
addCloudRows(const Case& one,
             const std::vector<CloudCheck>& checks,
             const ConsistencyChoice& choice,
             Report& report)
{
  for (const CloudCheck& check : checks)
    for (const Json& of_type : rowsOf(check))
      if (choice.types.empty() || chosen(choice.types, of_type["type"]))
        report.rows.push_back(cloudRow(one.scene, one, of_type));
}

// Every limit at several values, in the order of limitSets(), for each radius.
void
addLimitRows(const std::string& scene,
             const Case& one,
             const std::vector<CloudCheck>& checks,
             std::vector<Json>& rows)
{
  const std::vector<LimitSet> sets = limitSets();
  for (std::size_t i = 0; i < checks.size(); ++i)
    rows.push_back(cloudRow(scene, one, limitRow(sets[i % sets.size()], checks[i])));
}

CloudCheckOptions
cloudOptions(const Case& one, const ConsistencyChoice& choice)
{
  CloudCheckOptions options;
  options.scene = one.scene;
  options.fit = one.options.fit;
  options.mode = one.mode;
  if (choice.by_limits)
    options.limits = optionsOf(limitSets());
  return options;
}

// All scenes of one mode and one set of options together.
class PooledClouds {
public:
  void add(const Case& one, const std::vector<CloudCheck>& checks)
  {
    const auto found =
        std::find_if(pools_.begin(), pools_.end(), [&one](const Pool& pool) {
          return pool.of.mode == one.mode && pool.of.options.name == one.options.name;
        });
    Pool& pool = found != pools_.end() ? *found : pools_.emplace_back(Pool{one, {}});
    pool.checks.resize(checks.size());
    for (std::size_t i = 0; i < checks.size(); ++i)
      addTo(pool.checks[i], checks[i]);
  }

  void addRowsTo(std::vector<Json>& rows) const
  {
    for (const Pool& pool : pools_)
      addLimitRows("all", pool.of, pool.checks, rows);
  }

private:
  struct Pool {
    Case of;
    std::vector<CloudCheck> checks;
  };

  std::vector<Pool> pools_;
};

void
checkCloudScenes(const std::vector<Case>& cases,
                 const ConsistencyChoice& choice,
                 const ExperimentSettings& settings,
                 Report& report)
{
  if (cases.empty())
    return;
  const Sensor sensor = cloudSensor(choice);
  PooledClouds pooled;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    CloudCheckOptions options = cloudOptions(cases[i], choice);
    options.frames = std::max(1, settings.trials / kTrialsPerFrame);
    options.seed = settings.seed;
    options.threads = settings.threads;
    options.progress = stageProgress(settings.progress,
                                     static_cast<int>(i),
                                     static_cast<int>(cases.size()));
    const std::vector<CloudCheck> checks = checkClouds(kCloudRadii_m, sensor, options);
    if (choice.by_limits) {
      addLimitRows(cases[i].scene, cases[i], checks, report.rows);
      pooled.add(cases[i], checks);
    }
    else {
      addCloudRows(cases[i], checks, choice, report);
    }
  }
  if (!choice.by_limits)
    return describeClouds(report);
  pooled.addRowsTo(report.summary);
  report.rows.insert(report.rows.begin(), report.summary.begin(), report.summary.end());
  describeLimits(report);
}

Report
runConsistency(const ConsistencyChoice& choice, const ExperimentSettings& settings)
{
  const std::vector<Case> patches = casesOf(choice), clouds = cloudCasesOf(choice);
  if (!clouds.empty() && choice.noise_scale != 1.0)
    throw CLI::ValidationError("--noise-scale", "goes with scenes of one patch only");
  if (choice.by_limits && (!patches.empty() || !choice.types.empty()))
    throw CLI::ValidationError("--limits",
                               "goes with whole clouds (--scene rocks, table, stairs, "
                               "mix) of all types only");
  Report report;
  report.columns = {{"scene", "scene"},
                    {"type", "type"},
                    {"mode", "mode"},
                    {"options", "options"}};
  addPatchRows(patches, choice, settings, report);
  checkCloudScenes(clouds, choice, settings, report);
  completeRows(report.rows);
  return report;
}

void
addChoices(CLI::App& command, ConsistencyChoice& choice)
{
  std::vector<std::string> types, modes, options, scenes = kScenes;
  for (const PatchType type : kPatchTypes)
    types.push_back(typeName(type));
  for (const CovarianceMode mode : kAllCovarianceModes)
    modes.push_back(std::string(covarianceModeName(mode)));
  for (const OptionSet& set : optionSets())
    options.push_back(set.name);
  scenes.insert(scenes.end(), kClouds.begin(), kClouds.end());
  const auto add = [&](const std::string& name,
                       std::vector<std::string>& values,
                       const std::vector<std::string>& allowed,
                       const std::string& description) {
    command.add_option(name, values, description)
        ->check(oneOf(allowed, [allowed](const std::string& word) {
          return chosen(allowed, word);
        }));
  };
  add("--type", choice.types, types, "Only these patch types");
  add("--mode", choice.modes, modes, "Covariance modes (default: exact)");
  add("--scene",
      choice.scenes,
      scenes,
      "Only these scenes (default: all of one patch, the first seven)");
  add("--options", choice.options, options, "Option sets (default: default)");
  command.add_flag("--limits",
                   choice.by_limits,
                   "Of whole clouds: the accepted patches by the limits of acceptance, "
                   "each in turn tightened, loosened and off");
  command.add_flag_callback(
      "--paper",
      [&choice] { choice.options = {"paper"}; },
      "The paper's choices, as --options paper");
}

std::string
joinedSensors()
{
  std::string text;
  for (const std::string& name : listSensors())
    text += (text.empty() ? "" : ", ") + name;
  return text;
}

void
addNoiseOptions(CLI::App& command, ConsistencyChoice& choice)
{
  command
      .add_option("--noise-scale",
                  choice.noise_scale,
                  "Factor on the noise's sigmas; of scenes of one patch")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--sensor",
                  choice.sensor,
                  "Draw the noise of this sensor and what neighbouring pixels share of "
                  "it (its pattern), and fit with both; a YAML file or one of " +
                      joinedSensors() + " (default: the paper's Kinect, no pattern)")
      ->type_name("NAME|FILE");
  command.add_flag("--no-pattern",
                   choice.no_pattern,
                   "Draw and take the errors of neighbouring pixels as independent");
}

} // namespace

Experiment
consistencyExperiment()
{
  Experiment experiment;
  experiment.name = "consistency";
  experiment.former_name = "calibration";
  experiment.summary = "Predicted covariances against Monte Carlo on known scenes";
  experiment.trials_meaning =
      "noise draws per row; of whole clouds one frame for each hundred";
  experiment.default_trials = 3000;
  experiment.prepare = [](CLI::App& command) -> ExperimentRun {
    const auto choice = std::make_shared<ConsistencyChoice>();
    addChoices(command, *choice);
    addNoiseOptions(command, *choice);
    return [choice](const ExperimentSettings& settings) {
      return runConsistency(*choice, settings);
    };
  };
  return experiment;
}

} // namespace holdfast::app
