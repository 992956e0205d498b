// The paper's Figure 5: metrics of an elliptic paraboloid as the sensor moves.
#include "experiment.h"
#include "scene.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <cmath>

namespace holdfast::app {
namespace {

constexpr int kPatchesDrawn = 10000;

/// Of the Monte Carlo mean on either side of it, in standard errors.
constexpr double kBand = 3.0;

/// Where the sensor stands in a station of the figure; it always looks at the patch.
struct Station {
  int axis; ///< of the coordinate that is varied
  Eigen::Vector3d position;
};

/// The paper's frustum at (-1, -1, 6) m, moved along one axis at a time.
std::vector<Station>
stations()
{
  const auto sweep = [](int axis, double low, double high, double step, auto& out) {
    const int n = static_cast<int>(std::lround((high - low) / step));
    for (int i = 0; i <= n; ++i) {
      Eigen::Vector3d position(-1.0, -1.0, 6.0);
      position[axis] = low + step * i;
      out.push_back({axis, position});
    }
  };
  std::vector<Station> result;
  sweep(2, 3.0, 6.5, 0.25, result);
  sweep(0, -3.0, 3.0, 0.5, result);
  sweep(1, -3.0, 3.0, 0.5, result);
  return result;
}

constexpr const char* kAxisNames[] = {"x", "y", "z"};

Json
measure(const Station& station,
        const ExperimentSettings& settings,
        const Progress& progress)
{
  const PatchType type = kPatchTypes[0];
  Scene scene = tableTwoScene(type).scene;
  scene.sensor_pose =
      lookAt(station.position, scene.patches.front().c, Eigen::Vector3d::UnitY());
  const FitOptions options = withType(FitOptions{}, type);
  PointBatch batch = noiseFreeBatch(scene, frustumRays(30, kPi / 3.0), *kinectNoise());
  const FitResult fit = estimatePatch(batch, options);

  Json row = {{"axis", kAxisNames[station.axis]},
              {"x", station.position.x()},
              {"y", station.position.y()},
              {"z", station.position.z()},
              {"points", fit.points},
              {"status", statusName(fit.status)}};
  if (!isUsable(fit.status))
    return row;
  std::mt19937_64 generator(settings.seed);
  const PatchMetrics exact =
      sampleMetrics(fit.patch, fit.covariance, generator, kPatchesDrawn);
  MonteCarloOptions monte_carlo;
  monte_carlo.trials = settings.trials;
  monte_carlo.seed = settings.seed;
  monte_carlo.threads = settings.threads;
  monte_carlo.progress = progress;
  const MonteCarloResult truth =
      monteCarloCovariance(fit.patch, batch, options, monte_carlo);
  row["failures"] = truth.failures;
  if (truth.samples.size() < 2)
    return row;
  const PatchMetrics refits = metricsOf(unpack(type, truth.mean), truth.samples);
  for (const Metric& metric : kMetrics) {
    addMeanAndVariance(row, std::string("exact_") + metric.name, exact.*metric.value);
    addMeanAndVariance(row,
                       std::string("monte_carlo_") + metric.name,
                       refits.*metric.value);
  }
  return row;
}

/// The line of the exact mode in the band of the truth.
Series
seriesOf(const Metric& metric, int axis, const std::vector<Json>& rows, int trials)
{
  Series series;
  series.name = std::string(metric.name) + " (" + metric.unit + ")";
  // Phi_6 lies on Phi_5.
  if (metric.value == &PatchMetrics::phi_6)
    series.style = SeriesStyle::DashedLine;
  const std::string exact = std::string("exact_") + metric.name + "_mean";
  const std::string truth = std::string("monte_carlo_") + metric.name;
  for (const Json& row : rows) {
    if (row["axis"] != kAxisNames[axis] || !row.contains(exact))
      continue;
    const double mean = row[truth + "_mean"];
    const double error = std::sqrt(row[truth + "_variance"].get<double>() / trials);
    series.x.push_back(row[kAxisNames[axis]]);
    series.y.push_back(row[exact]);
    series.low.push_back(mean - kBand * error);
    series.high.push_back(mean + kBand * error);
  }
  return series;
}

Plot
plotOf(const std::vector<Json>& rows, int trials)
{
  Plot plot;
  plot.columns = 3;
  for (const int axis : {2, 0, 1}) {
    const std::string name = kAxisNames[axis];
    Panel panel;
    panel.title = "Line: exact. Band: Monte Carlo, mean +- 3 standard errors";
    panel.x = {name + " of the sensor (m)"};
    panel.y = {"mean distance of patches (unit of the metric)", true};
    for (const Metric& metric : kMetrics)
      panel.series.push_back(seriesOf(metric, axis, rows, trials));
    plot.panels.push_back(panel);
  }
  return plot;
}

std::vector<Column>
columns()
{
  std::vector<Column> result{{"moved", "axis"},
                             {"x", "x"},
                             {"y", "y"},
                             {"z", "z"},
                             {"points", "points"}};
  for (const Metric& metric : kMetrics)
    for (const auto& [key, heading] :
         {std::pair("exact_", ""), {"monte_carlo_", " true"}})
      result.push_back({std::string(metric.name) + heading,
                        key + std::string(metric.name) + "_mean"});
  result.push_back({"failures", "failures"});
  return result;
}

Report
run(const ExperimentSettings& settings)
{
  Report report;
  report.columns = columns();
  const std::vector<Station> all = stations();
  const int n = static_cast<int>(all.size());
  for (int i = 0; i < n; ++i)
    report.rows.push_back(measure(all[static_cast<std::size_t>(i)],
                                  settings,
                                  stageProgress(settings.progress, i, n)));
  report.remarks = {
      "Mean distances of patches drawn from the exact covariance, and of refits with "
      "fresh noise from their mean (true). The sensor, 60 x 60 degrees with 30 x 30 "
      "rays, is at (-1, -1, 6) m but for the coordinate that is moved, and looks at "
      "the elliptic paraboloid of the paper's Table II."};
  report.plot = plotOf(report.rows, settings.trials);
  return report;
}

} // namespace

Experiment
figureFiveExperiment()
{
  return {"figure5",
          "Metrics of an elliptic paraboloid as the sensor moves: the paper's Figure 5",
          "Refits at each station with fresh noise",
          2000,
          [](CLI::App&) { return ExperimentRun(run); }};
}

} // namespace holdfast::app
