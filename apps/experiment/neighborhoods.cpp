// What the choice of a neighbourhood does to the statistics of the fit inside it.
#include "experiment.h"
#include "scene.h"

#include <holdfast/fit/reference_points.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <Eigen/Cholesky>

#include <cmath>
#include <stdexcept>

namespace holdfast::app {
namespace {

/// At 1.05 m sigma_z is 4.3 mm and pixels are 1.8 mm apart.
constexpr double kDistance = 1.05;
constexpr double kTilt = 0.3; // rad
constexpr int kWindow = 101; // px; the largest disc, 70 mm, is 77 across

constexpr std::array<double, 7> kRadii{0.0126, 0.017, 0.023, 0.03, 0.04, 0.05, 0.07};

struct NeighborhoodKind {
  Neighborhood neighborhood;
  const char* name;
};
constexpr std::array<NeighborhoodKind, 3> kKinds{
    {{Neighborhood::Disc, "disc"},
     {Neighborhood::Ball, "ball"},
     {Neighborhood::Geodesic, "geodesic"}}};

/// The middle of a Kinect's image.
Sensor
windowSensor()
{
  Sensor sensor;
  sensor.name = "window";
  sensor.camera =
      {kWindow, kWindow, 580.0, 580.0, 0.5 * (kWindow - 1), 0.5 * (kWindow - 1)};
  sensor.noise = kinectNoise();
  return sensor;
}

/// A tilted plane that fills the window, in the frame of the camera.
Scene
planeScene()
{
  Scene scene;
  Patch plane;
  plane.type = {SurfaceType::Plane, BoundaryType::Circle};
  plane.d[0] = 1.0;
  // The normal towards the camera, tilted about x.
  plane.r = {kPi - kTilt, 0.0, 0.0};
  plane.c = {0.0, 0.0, kDistance};
  scene.patches = {plane};
  return scene;
}

/// One fit, or none.
struct Outcome {
  bool usable = false;
  int points = 0;
  double chi2 = 0.0;
  int chi2_dof = 0;
  double nees = 0.0;
};

PointBatch
batchOf(const std::vector<Eigen::Vector3d>& points,
        const std::vector<int>& indices,
        const NoiseModel& noise)
{
  // Coordinates relative to the camera, which is at the origin.
  PointBatch batch;
  batch.clear(Eigen::Vector3d::Zero());
  for (const int i : indices)
    batch.add(points[static_cast<std::size_t>(i)], Eigen::Matrix3d::Zero());
  computeReferencePoints(batch, Eigen::Vector3d::Zero());
  noise.covariances(batch.size(),
                    batch.channel(PointBatch::RX),
                    batch.channel(PointBatch::RY),
                    batch.channel(PointBatch::RZ),
                    {batch.channel(PointBatch::SXX),
                     batch.channel(PointBatch::SXY),
                     batch.channel(PointBatch::SXZ),
                     batch.channel(PointBatch::SYY),
                     batch.channel(PointBatch::SYZ),
                     batch.channel(PointBatch::SZZ)});
  return batch;
}

/// Normalised estimation error squared of a plane with circular bound. In the tangent
/// space: r_xy itself is strongly curved for normals that look back at the camera.
double
normalizedError(const FitResult& fit, const Patch& reference)
{
  ParameterVector error = pack(reference) - pack(fit.patch);
  // Exp(delta) z = z + delta x z: the normal of the reference in the axes of the fit.
  const Eigen::Vector3d normal = expMap(fit.patch.r).transpose() * reference.normal();
  error.segment<2>(layoutOf(fit.patch.type).r()) << -normal.y(), normal.x();
  return error.dot(toTangent(fit.patch, fit.covariance).ldlt().solve(error));
}

/// The error is against the fit to the true points of the same pixels.
Outcome
fitNeighborhood(const RangeImage& image,
                const std::vector<int>& indices,
                const NoiseModel& noise,
                const PatchEstimator& estimator,
                const PatchEstimator& reference_estimator)
{
  Outcome outcome;
  PointBatch measured = batchOf(image.points, indices, noise);
  PointBatch truth = batchOf(image.truth, indices, noise);
  const FitResult fit = estimator.estimate(measured);
  const FitResult reference = reference_estimator.estimate(truth);
  outcome.usable = isUsable(fit.status) && isUsable(reference.status);
  if (!outcome.usable)
    return outcome;
  outcome.points = fit.points;
  outcome.chi2 = fit.chi2;
  outcome.chi2_dof = fit.chi2_dof;
  outcome.nees = normalizedError(fit, reference.patch);
  return outcome;
}

using TrialOutcomes = std::array<std::array<Outcome, kRadii.size()>, kKinds.size()>;

/// Every kind and radius on one noisy image.
TrialOutcomes
runTrial(RangeImage image, const Sensor& sensor, std::mt19937_64& generator)
{
  drawNoise(image.truth, image.roots, generator, image.points);
  const RangeCloud cloud = cloudOf(image);
  FitOptions fit;
  fit.surface = SurfaceRequest::Plane;
  fit.plane_boundary = BoundaryType::Circle;
  const PatchEstimator estimator(fit);
  fit.debias_scatter = false; // the scatter of true points has no noise to subtract
  const PatchEstimator reference_estimator(fit);
  const int middle = kWindow * kWindow / 2;
  TrialOutcomes outcomes;
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind)
    for (std::size_t i = 0; i < kRadii.size(); ++i) {
      SamplerOptions options;
      options.neighborhood = kKinds[kind].neighborhood;
      options.radius_m = kRadii[i];
      const NeighborhoodSampler sampler(cloud, sensor, options);
      std::vector<int> indices;
      const auto scratch = sampler.makeScratch();
      sampler.neighborhood(middle, *scratch, indices);
      outcomes[kind][i] = fitNeighborhood(image,
                                          indices,
                                          *sensor.noise,
                                          estimator,
                                          reference_estimator);
    }
  return outcomes;
}

Json
rowOf(std::size_t kind, std::size_t radius, const std::vector<TrialOutcomes>& trials)
{
  double usable = 0.0, points = 0.0, chi2 = 0.0, dof = 0.0, nees = 0.0;
  double ratios = 0.0, ratio_squares = 0.0, nees_squares = 0.0;
  for (const TrialOutcomes& trial : trials) {
    const Outcome& outcome = trial[kind][radius];
    if (!outcome.usable)
      continue;
    ++usable;
    points += outcome.points;
    chi2 += outcome.chi2;
    dof += outcome.chi2_dof;
    nees += outcome.nees;
    const double ratio = outcome.chi2 / outcome.chi2_dof;
    ratios += ratio;
    ratio_squares += ratio * ratio;
    nees_squares += std::pow(outcome.nees, 2);
  }
  const int n_parameters = degreesOfFreedom({SurfaceType::Plane, BoundaryType::Circle});
  const double mean_nees = nees / usable;
  const auto standard_error = [usable](double squares, double mean) {
    return std::sqrt(std::max(0.0, squares / usable - mean * mean) / usable);
  };
  return {
      {"neighborhood", kKinds[kind].name},
      {"radius_m", kRadii[radius]},
      {"points", points / usable},
      {"chi2_per_dof", chi2 / dof},
      {"chi2_standard_error", standard_error(ratio_squares, ratios / usable)},
      {"nees_per_dof", mean_nees / n_parameters},
      {"nees_standard_error", standard_error(nees_squares, mean_nees) / n_parameters},
      {"failures", static_cast<double>(trials.size()) - usable}};
}

Panel
panelOf(const std::vector<Json>& rows,
        const std::string& title,
        const std::string& key,
        const std::string& error_key)
{
  Panel panel;
  panel.title = title;
  panel.x = {"radius (m)", true};
  panel.y = {title + " (1 is right)"};
  for (const NeighborhoodKind& kind : kKinds) {
    Series series{kind.name, {}, {}};
    for (const Json& row : rows)
      if (row["neighborhood"] == kind.name) {
        const double value = row[key], error = row[error_key];
        series.x.push_back(row["radius_m"]);
        series.y.push_back(value);
        series.low.push_back(value - 3.0 * error);
        series.high.push_back(value + 3.0 * error);
      }
    panel.series.push_back(series);
  }
  return panel;
}

Report
run(const ExperimentSettings& settings)
{
  const Sensor sensor = windowSensor();
  RangeImage image = castRays(planeScene(), pixelRays(sensor.camera));
  attachNoise(image, *sensor.noise);
  std::vector<TrialOutcomes> trials(static_cast<std::size_t>(settings.trials));
  parallelFor(
      settings.trials,
      settings.threads,
      [&](int i, int) {
        std::mt19937_64 generator =
            trialGenerator(settings.seed, static_cast<std::uint64_t>(i));
        trials[static_cast<std::size_t>(i)] = runTrial(image, sensor, generator);
      },
      settings.progress);
  Report report;
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind)
    for (std::size_t i = 0; i < kRadii.size(); ++i)
      report.rows.push_back(rowOf(kind, i, trials));
  report.columns = {{"neighbourhood", "neighborhood"},
                    {"radius (m)", "radius_m"},
                    {"points", "points"},
                    {"chi2/dof", "chi2_per_dof"},
                    {"std. error", "chi2_standard_error"},
                    {"NEES/dof", "nees_per_dof"},
                    {"std. error", "nees_standard_error"},
                    {"failures", "failures"}};
  report.remarks = {
      "Plane fits around one pixel of a simulated plane at 1.05 m, tilted by 0.3 rad, "
      "Kinect noise (sigma_z 4.3 mm). NEES is about the fit to the true points of the "
      "same pixels. A ball cuts off the points that noise has moved out of it along "
      "the "
      "ray, so small ones show too little of it, and since which points it holds "
      "depends on "
      "the noise, its NEES is off at any radius. A disc of pixels does not choose by "
      "depth."};
  report.plot.columns = 2;
  report.plot.panels = {
      panelOf(report.rows, "chi2/dof", "chi2_per_dof", "chi2_standard_error"),
      panelOf(report.rows, "NEES/dof", "nees_per_dof", "nees_standard_error")};
  return report;
}

} // namespace

Experiment
neighborhoodsExperiment()
{
  return {"neighborhoods",
          "Statistics of plane fits in discs, balls and geodesic neighbourhoods",
          "Noisy images",
          1000,
          [](CLI::App&) { return ExperimentRun(run); }};
}

} // namespace holdfast::app
