// The paper's Figure 6: metrics of 150 patches on a rock seen by a Kinect.
#include "experiment.h"
#include "scene.h"
#include "survey.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

namespace holdfast::app {
namespace {

constexpr int kPatches = 150;
constexpr double kDistance = 1.2; // m
constexpr const char* kSurveyFile = "otira_rocks_west.ply";
constexpr double kSurveySpacing = 0.01; // m

/// The sensor looks down at a rock from aside.
Pose
lookDownAt(const Eigen::Vector3d& target)
{
  constexpr double kElevation = 0.9, kAzimuth = -2.6; // rad
  const Eigen::Vector3d line_of_sight(std::cos(kElevation) * std::cos(kAzimuth),
                                      std::cos(kElevation) * std::sin(kAzimuth),
                                      std::sin(kElevation));
  return lookAt(target + kDistance * line_of_sight, target, Eigen::Vector3d::UnitZ());
}

/// 0.9 m long, its bumps some 3 cm high, the top at the origin.
Scene
boulderScene()
{
  Scene scene;
  scene.name = "simulated boulder";
  const Eigen::Vector3d radii(0.45, 0.38, 0.32);
  Pose pose;
  pose.c = {0.0, 0.0, -radii.z()};
  scene.shapes = {std::make_shared<Boulder>(pose, radii, 0.1, 6)};
  scene.sensor_pose = lookDownAt(Eigen::Vector3d::Zero());
  return scene;
}

Scene
surveyScene(const std::string& folder)
{
  Scene scene;
  scene.name = "surveyed river boulder";
  const std::string path = (std::filesystem::path(folder) / kSurveyFile).string();
  const auto surface =
      std::make_shared<SurveyedSurface>(loadCloud(path).points, kSurveySpacing);
  scene.shapes = {surface};
  scene.sensor_pose = lookDownAt(surface->highestPoint());
  return scene;
}

/// Patches on one rock and the image they were found in.
struct Rock {
  std::string name;
  Sensor sensor;
  RangeImage image;
  std::vector<ExtractedPatch> patches;
};

Rock
patchesOn(const Scene& scene, const ExperimentSettings& settings)
{
  Rock rock;
  rock.name = scene.name;
  rock.sensor = loadSensor("kinect_v1");
  std::mt19937_64 generator(settings.seed);
  rock.image =
      simulate(scene, pixelRays(rock.sensor.camera), rock.sensor, {}, generator);
  ExtractionOptions options;
  options.sampler.radius_m = 0.05;
  options.sampler.spacing_m = 0.03;
  options.sampler.strategy = SeedStrategy::Poisson;
  options.sampler.random_seed = settings.seed;
  options.threads = settings.threads;
  rock.patches = extractPatches(cloudOf(rock.image), rock.sensor, options).patches;
  // Seeds are in random order: these are a fair sample.
  if (rock.patches.size() > kPatches)
    rock.patches.resize(kPatches);
  return rock;
}

Json
patchRow(const Rock& rock, int index, const ExperimentSettings& settings)
{
  const FitResult& fit = rock.patches[static_cast<std::size_t>(index)].fit;
  std::mt19937_64 generator =
      trialGenerator(settings.seed, static_cast<std::uint64_t>(index));
  const PatchMetrics metrics =
      sampleMetrics(fit.patch, fit.covariance, generator, settings.trials);
  Json row = {{"rock", rock.name},
              {"patch", index},
              {"surface", surfaceName(fit.patch.type.surface)},
              {"status", statusName(fit.status)},
              {"points", fit.points},
              {"chi2_per_dof", chi2PerDof(fit)},
              {"range_m", (fit.patch.c - rock.image.sensor_pose.c).norm()}};
  for (const Metric& metric : kMetrics) {
    if (metric.value == &PatchMetrics::phi_k &&
        fit.patch.type.surface == SurfaceType::Plane)
      row[std::string(metric.name) + "_mean"] = Json();
    else
      addMeanAndVariance(row, metric.name, metrics.*metric.value);
  }
  return row;
}

/// Values of one metric, the largest first; planes have no curvature.
std::vector<double>
sortedMeans(const std::vector<Json>& rows, const Metric& metric)
{
  std::vector<double> values;
  for (const Json& row : rows)
    if (const Json& value = row[std::string(metric.name) + "_mean"]; !value.is_null())
      values.push_back(value);
  std::sort(values.rbegin(), values.rend());
  return values;
}

Panel
metricsPanel(const Rock& rock, const std::vector<Json>& rows)
{
  Panel panel;
  panel.title = std::to_string(rows.size()) + " patches on a " + rock.name;
  panel.x = {"patches, by each metric from the largest"};
  panel.y = {"mean distance (unit of the metric)", true};
  for (const Metric& metric : kMetrics) {
    Series series{std::string(metric.name) + " (" + metric.unit + ")", {}, {}};
    // Phi_6 lies on Phi_5.
    if (metric.value == &PatchMetrics::phi_6)
      series.style = SeriesStyle::DashedLine;
    series.y = sortedMeans(rows, metric);
    for (std::size_t i = 1; i <= series.y.size(); ++i)
      series.x.push_back(static_cast<double>(i));
    panel.series.push_back(series);
  }
  return panel;
}

void
addPixel(const Rock& rock, const Eigen::Vector3d& world, Series& series)
{
  const Eigen::Vector2d pixel =
      rock.sensor.camera.project(rock.image.sensor_pose.toLocal(world));
  series.x.push_back(pixel.x());
  series.y.push_back(pixel.y());
}

/// The boundary of a patch on its surface, as the camera sees it.
Series
outlineSeries(const Rock& rock, const Patch& patch)
{
  Series series{std::string(surfaceName(patch.type.surface)), {}, {}};
  std::replace(series.name.begin(), series.name.end(), '_', ' ');
  series.style = SeriesStyle::Polygon;
  for (const Eigen::Vector2d& xy : outline(patch, 0.25 * patch.d[0]))
    if (const auto z = height(patch, xy.x(), xy.y()))
      addPixel(rock, patch.pose().toWorld({xy.x(), xy.y(), *z}), series);
  return series;
}

Panel
picturePanel(const Rock& rock)
{
  constexpr int kStep = 5; // px between the dots that show the rock
  Panel panel;
  panel.title = "The patches as the sensor sees them";
  panel.x = {"u (px)"};
  panel.y = {"v (px)"};
  panel.y.downwards = true;
  panel.equal_scales = true;
  Series dots{"", {}, {}, SeriesStyle::Dots};
  for (int v = 0; v < rock.image.height; v += kStep)
    for (int u = 0; u < rock.image.width; u += kStep)
      if (rock.image.hits[static_cast<std::size_t>(v * rock.image.width + u)] >= 0) {
        dots.x.push_back(u);
        dots.y.push_back(v);
      }
  panel.series.push_back(dots);
  for (const ExtractedPatch& patch : rock.patches)
    panel.series.push_back(outlineSeries(rock, patch.fit.patch));
  return panel;
}

/// Quantiles of one metric over the patches of a rock.
Json
summaryRow(const Rock& rock, const std::vector<Json>& rows, const Metric& metric)
{
  const std::vector<double> values = sortedMeans(rows, metric);
  Json row = {{"rock", rock.name},
              {"metric", metric.name},
              {"unit", metric.unit},
              {"patches", values.size()}};
  for (const auto& [name, share] : {std::pair("smallest", 1.0),
                                    {"tenth", 0.9},
                                    {"median", 0.5},
                                    {"ninetieth", 0.1},
                                    {"largest", 0.0}}) {
    const double at = share * (static_cast<double>(values.size()) - 1.0);
    row[name] = values.empty() ? Json() : Json(values[static_cast<std::size_t>(at)]);
  }
  return row;
}

void
addRock(const Rock& rock, const ExperimentSettings& settings, Report& report)
{
  const int n = static_cast<int>(rock.patches.size());
  std::vector<Json> rows(rock.patches.size());
  parallelFor(
      n,
      settings.threads,
      [&](int i, int) {
        rows[static_cast<std::size_t>(i)] = patchRow(rock, i, settings);
      },
      settings.progress);
  for (const Metric& metric : kMetrics)
    report.summary.push_back(summaryRow(rock, rows, metric));
  report.rows.insert(report.rows.end(), rows.begin(), rows.end());
  report.plot.panels.push_back(metricsPanel(rock, rows));
  report.plot.panels.push_back(picturePanel(rock));
}

Report
run(const ExperimentSettings& settings, const std::string& data_folder)
{
  Report report;
  report.plot.columns = 2;
  report.columns = {{"rock", "rock"},
                    {"metric", "metric"},
                    {"unit", "unit"},
                    {"patches", "patches"},
                    {"smallest", "smallest"},
                    {"10 %", "tenth"},
                    {"median", "median"},
                    {"90 %", "ninetieth"},
                    {"largest", "largest"}};
  addRock(patchesOn(boulderScene(), settings), settings, report);
  report.remarks = {"Mean distance of patches drawn from each patch's covariance, over "
                    "the patches on a rock 1.2 m from a Kinect, neighbourhoods of 5 cm "
                    "radius. CSV and JSON have every patch."};
  if (std::filesystem::exists(std::filesystem::path(data_folder) / kSurveyFile))
    addRock(patchesOn(surveyScene(data_folder), settings), settings, report);
  else
    report.remarks.push_back(std::string("With ") + kSurveyFile +
                             " in the folder of --data, a surveyed river boulder too.");
  return report;
}

} // namespace

Experiment
figureSixExperiment()
{
  return {"figure6",
          "Metrics of 150 patches on a rock: the paper's Figure 6",
          "Patches drawn from each covariance",
          10000,
          [](CLI::App& command) {
            const auto folder = std::make_shared<std::string>();
            addDataOption(command, *folder);
            return ExperimentRun([folder](const ExperimentSettings& settings) {
              return run(settings, *folder);
            });
          }};
}

} // namespace holdfast::app
