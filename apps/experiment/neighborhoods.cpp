// What the choice of a neighbourhood does to the statistics of the fit inside it.
#include "experiment.h"
#include "scene.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/uncertainty/monte_carlo.h>
#include <holdfast/validation/checks.h>

#include "evaluation/fit_error.h"
#include "pcl/point_gatherer.h"

#include <cmath>
#include <stdexcept>

namespace holdfast::app {
namespace {

/// At 1.05 m sigma_z is 4.3 mm and pixels are 1.8 mm apart.
constexpr double kDistance = 1.05;
constexpr int kWindow = 101; // px; the largest disc, 70 mm, is 77 across

/// What is varied: radii at one tilt, tilts at one radius, and both kinds of noise.
struct Setting {
  double radius_m;
  double tilt_rad;
  bool pattern;
};

constexpr double kUsualTilt = 0.3, kUsualRadius = 0.05;

std::vector<Setting>
settingsOf()
{
  std::vector<Setting> settings;
  for (const bool pattern : {false, true}) {
    for (const double radius : {0.0126, 0.017, 0.023, 0.03, 0.04, 0.05, 0.07})
      settings.push_back({radius, kUsualTilt, pattern});
    for (const double tilt : {0.0, 0.6, 0.9, 1.1, 1.3})
      settings.push_back({kUsualRadius, tilt, pattern});
  }
  return settings;
}

struct NeighborhoodKind {
  Neighborhood neighborhood;
  const char* name;
};
constexpr std::array<NeighborhoodKind, 4> kKinds{
    {{Neighborhood::Patch, "patch"},
     {Neighborhood::Disc, "disc"},
     {Neighborhood::Ball, "ball"},
     {Neighborhood::Geodesic, "geodesic"}}};

/// The middle of a Kinect's image.
/// \param pattern with errors that pixels share, those measured on recordings
Sensor
windowSensor(bool pattern)
{
  Sensor sensor;
  sensor.name = "window";
  sensor.camera =
      {kWindow, kWindow, 580.0, 580.0, 0.5 * (kWindow - 1), 0.5 * (kWindow - 1)};
  sensor.noise = kinectNoise();
  if (pattern)
    sensor.pattern.waves = {{0.089, 2.1, PatternShape::Exponential},
                            {0.103, 79.0, PatternShape::Exponential}};
  return sensor;
}

/// A tilted plane that fills the window, in the frame of the camera.
Scene
planeScene(double tilt)
{
  Scene scene;
  Patch plane;
  plane.type = {SurfaceType::Plane, BoundaryType::Circle};
  plane.d[0] = 1.0;
  // The normal towards the camera, tilted about x.
  plane.r = {kPi - tilt, 0.0, 0.0};
  plane.c = {0.0, 0.0, kDistance};
  scene.patches = {plane};
  return scene;
}

/// One fit, or none.
struct Outcome {
  bool usable = false;
  int points = 0;
  double chi2 = 0.0;
  double chi2_expected = 0.0;
  double nees = 0.0;
  double extent = 0.0; ///< of the true points, over the radius asked for
};

/// One kind on one noisy image.
class Trial {
public:
  Trial(const RangeImage& image, const Sensor& sensor, const SamplerOptions& options)
  : image_(image)
  , cloud_(cloudOf(image))
  , sampler_(cloud_, sensor, options)
  , scratch_(sampler_.makeScratch())
  , gatherer_(cloud_, sensor, true)
  , radius_m_(options.radius_m)
  {}

  /// The error is against the fit to the true points of the same pixels.
  Outcome run()
  {
    const int middle = kWindow * kWindow / 2;
    sampler_.neighborhood(middle, *scratch_, indices_);
    FitOptions options;
    options.surface = SurfaceRequest::Plane;
    options.plane_boundary = BoundaryType::Circle;
    const FitResult fit = fitted(false, options);
    options.debias_scatter = false; // true points have no noise to subtract
    const FitResult reference = fitted(true, options);
    Outcome outcome;
    outcome.usable = isUsable(fit.status) && isUsable(reference.status);
    if (!outcome.usable)
      return outcome;
    outcome.points = fit.points;
    outcome.chi2 = fit.chi2;
    outcome.chi2_expected = fit.chi2_expected;
    outcome.nees = stateError(fit, reference.state).nees_per_dof;
    outcome.extent =
        validate(reference, batch_, ValidationOptions::withoutLimits()).extent_m /
        radius_m_;
    return outcome;
  }

private:
  FitResult fitted(bool truth, const FitOptions& options)
  {
    gatherer_.gather(indices_, {0.0, 0.0, kDistance}, batch_);
    if (truth)
      takeTruth(image_, indices_, batch_);
    return estimatePatch(batch_, options);
  }

  const RangeImage& image_;
  RangeCloud cloud_;
  NeighborhoodSampler sampler_;
  NeighborhoodSampler::ScratchPtr scratch_;
  PointGatherer gatherer_;
  double radius_m_;
  std::vector<int> indices_;
  PointBatch batch_;
};

using TrialOutcomes = std::array<Outcome, kKinds.size()>;

/// Every kind on one noisy image.
TrialOutcomes
runTrial(RangeImage image,
         const Sensor& sensor,
         double radius_m,
         std::mt19937_64& generator)
{
  drawNoise(image, generator, image.points);
  TrialOutcomes outcomes;
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind) {
    SamplerOptions options;
    options.neighborhood = kKinds[kind].neighborhood;
    options.radius_m = radius_m;
    outcomes[kind] = Trial(image, sensor, options).run();
  }
  return outcomes;
}

Json
rowOf(std::size_t kind,
      const Setting& setting,
      const std::vector<TrialOutcomes>& trials)
{
  double usable = 0.0, points = 0.0, extent = 0.0;
  double ratios = 0.0, ratio_squares = 0.0, nees = 0.0, nees_squares = 0.0;
  for (const TrialOutcomes& trial : trials) {
    const Outcome& outcome = trial[kind];
    if (!outcome.usable)
      continue;
    ++usable;
    points += outcome.points;
    extent += outcome.extent;
    nees += outcome.nees;
    nees_squares += outcome.nees * outcome.nees;
    const double ratio = outcome.chi2 / outcome.chi2_expected;
    ratios += ratio;
    ratio_squares += ratio * ratio;
  }
  const auto standard_error = [usable](double squares, double mean) {
    return std::sqrt(std::max(0.0, squares / usable - mean * mean) / usable);
  };
  return {{"neighborhood", kKinds[kind].name},
          {"noise", setting.pattern ? "shared" : "independent"},
          {"radius_m", setting.radius_m},
          {"tilt_rad", setting.tilt_rad},
          {"points", points / usable},
          {"extent", extent / usable},
          {"chi2_ratio", ratios / usable},
          {"chi2_standard_error", standard_error(ratio_squares, ratios / usable)},
          {"nees_per_dof", nees / usable},
          {"nees_standard_error", standard_error(nees_squares, nees / usable)},
          {"failures", static_cast<double>(trials.size()) - usable}};
}

/// What is drawn over the radius or the tilt.
struct PanelKeys {
  std::string title, key, error_key; ///< no error key: none is drawn
  bool over_tilt = false;
};

Panel
panelOf(const std::vector<Json>& rows, const PanelKeys& keys)
{
  const std::string x = keys.over_tilt ? "tilt_rad" : "radius_m";
  Panel panel;
  panel.title = keys.title;
  panel.x = {keys.over_tilt ? "tilt (rad)" : "radius (m)", !keys.over_tilt};
  panel.y = {keys.title + " (1 is right)"};
  for (const NeighborhoodKind& kind : kKinds) {
    Series series{kind.name, {}, {}};
    for (const Json& row : rows) {
      const bool usual = keys.over_tilt ? row["radius_m"] == kUsualRadius :
                                          row["tilt_rad"] == kUsualTilt;
      if (row["neighborhood"] != kind.name || row["noise"] != "independent" || !usual)
        continue;
      const double value = row[keys.key];
      const double error =
          keys.error_key.empty() ? 0.0 : row[keys.error_key].get<double>();
      series.x.push_back(row[x]);
      series.y.push_back(value);
      series.low.push_back(value - 3.0 * error);
      series.high.push_back(value + 3.0 * error);
    }
    panel.series.push_back(series);
  }
  return panel;
}

void
addRows(const Setting& setting,
        const ExperimentSettings& settings,
        const Progress& progress,
        std::vector<Json>& rows)
{
  const Sensor sensor = windowSensor(setting.pattern);
  RangeImage image = castRays(planeScene(setting.tilt_rad), pixelRays(sensor.camera));
  attachNoise(image, sensor);
  std::vector<TrialOutcomes> trials(static_cast<std::size_t>(settings.trials));
  parallelFor(
      settings.trials,
      settings.threads,
      [&](int i, int) {
        std::mt19937_64 generator =
            trialGenerator(settings.seed, static_cast<std::uint64_t>(i));
        trials[static_cast<std::size_t>(i)] =
            runTrial(image, sensor, setting.radius_m, generator);
      },
      progress);
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind)
    rows.push_back(rowOf(kind, setting, trials));
}

Report
run(const ExperimentSettings& settings)
{
  Report report;
  const std::vector<Setting> all = settingsOf();
  for (std::size_t i = 0; i < all.size(); ++i)
    addRows(all[i],
            settings,
            stageProgress(settings.progress,
                          static_cast<int>(i),
                          static_cast<int>(all.size())),
            report.rows);
  report.columns = {{"neighbourhood", "neighborhood"},
                    {"noise", "noise"},
                    {"radius (m)", "radius_m"},
                    {"tilt (rad)", "tilt_rad"},
                    {"points", "points"},
                    {"extent", "extent"},
                    {"chi2 ratio", "chi2_ratio"},
                    {"std. error", "chi2_standard_error"},
                    {"NEES/dof", "nees_per_dof"},
                    {"std. error", "nees_standard_error"},
                    {"failures", "failures"}};
  report.remarks = {
      "Plane fits around one pixel of a simulated plane at 1.05 m, Kinect noise "
      "(sigma_z "
      "4.3 mm), independent or as pixels of recordings share it. NEES is about the fit "
      "to the true points of the same pixels, the extent that of a full disc of the "
      "radius asked for. A ball cuts off the points that noise has moved out of it "
      "along "
      "the ray, so small ones show too little of it, and since which points it holds "
      "depends on the noise, its NEES is off at any radius. A disc of pixels does not "
      "choose by depth, but stretches by 1/cos of the tilt; a patch does neither."};
  report.plot.columns = 3;
  report.plot.panels = {
      panelOf(report.rows, {"chi2 ratio", "chi2_ratio", "chi2_standard_error"}),
      panelOf(report.rows, {"NEES/dof", "nees_per_dof", "nees_standard_error"}),
      panelOf(report.rows, {"extent", "extent", "", true})};
  return report;
}

} // namespace

Experiment
neighborhoodsExperiment()
{
  return {"neighborhoods",
          "Statistics and extent of plane fits in all kinds of neighbourhoods",
          "Noisy images",
          1000,
          [](CLI::App&) { return ExperimentRun(run); }};
}

} // namespace holdfast::app
