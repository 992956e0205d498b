#include "pcl_comparison.h"

#include "console.h"

#include "experiment/scene.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/pcl/impl/sac_engine.h>
#include <holdfast/pcl/sac_model_patch.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <pcl/console/print.h>
#include <pcl/features/normal_3d.h>
#include <pcl/features/principal_curvatures.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_cylinder.h>
#include <pcl/sample_consensus/sac_model_plane.h>
#include <pcl/sample_consensus/sac_model_sphere.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

namespace holdfast::app { namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;
using ModelPtr = pcl::SampleConsensusModel<pcl::PointXYZ>::Ptr;

constexpr double kDistance = 1.0; // m
constexpr double kTilt = 0.5, kAzimuth = 0.6; // rad
constexpr int kStride = 2; // px between rays

/// Of the points that a threshold keeps, both for ours and, in m, for PCL: 3.9 mm is
/// the noise of the depth at 1 m.
constexpr double kThresholdSigmas = 3.0;
constexpr double kThreshold = kThresholdSigmas * 0.0039; // m

/// Of 20, 30, 50 and 100, the number with which PCL finds most cylinders.
constexpr int kNormalNeighbors = 20;

struct Subject {
  SurfaceRequest request;
  SurfaceType surface;
  double radius_m; ///< of the surface; of the patch, where that is a plane
};

constexpr std::array<Subject, 5> kSubjects{{
    {SurfaceRequest::Plane, SurfaceType::Plane, 0.1},
    {SurfaceRequest::Sphere, SurfaceType::Sphere, 0.1},
    {SurfaceRequest::Sphere, SurfaceType::Sphere, 0.05},
    {SurfaceRequest::CircularCylinder, SurfaceType::CircularCylinder, 0.1},
    {SurfaceRequest::CircularCylinder, SurfaceType::CircularCylinder, 0.05},
}};

/// The middle of a ball or can and its points as they would be without noise. Patches
/// of a surface twice as large are twice as large, so that the shape stays the same.
struct View {
  Patch patch;
  Pose sensor_pose;
  std::vector<Eigen::Vector3d> truth;
  std::vector<Eigen::Matrix3d> roots;
  NoiseModel::ConstPtr noise = kinectNoise();
};

View
viewOf(const Subject& subject)
{
  const PatchType type{subject.surface, defaultBoundary(subject.surface)};
  Scene scene = robotScene(type, kDistance, kTilt, kAzimuth).scene;
  View view;
  view.patch = scene.patches.front();
  view.patch.d.head(boundaryParameterCount(type.boundary))
      .setConstant(0.7 * subject.radius_m);
  if (subject.surface != SurfaceType::Plane)
    view.patch.kappa[0] = -1.0 / subject.radius_m;
  scene.patches.front() = view.patch;
  view.sensor_pose = scene.sensor_pose;
  RangeImage image = castRays(scene, pixelRays(Camera{}, kStride));
  attachNoise(image, *view.noise);
  for (std::size_t i = 0; i < image.truth.size(); ++i)
    if (image.hits[i] == 0) {
      view.truth.push_back(image.truth[i]);
      view.roots.push_back(image.roots[i]);
    }
  return view;
}

Cloud::Ptr
draw(const View& view, std::mt19937_64& generator)
{
  std::vector<Eigen::Vector3d> points;
  drawNoise(view.truth, view.roots, generator, points);
  auto cloud = pcl::make_shared<Cloud>();
  for (const Eigen::Vector3d& q : points) {
    pcl::PointXYZ& point = cloud->emplace_back();
    point.getVector3fMap() = q.cast<float>();
  }
  return cloud;
}

struct Estimate {
  double curvature = 0.0; ///< largest magnitude, 1/m
  double curvature_sigma = std::nan(""); ///< as predicted
  /// Normal of a plane, axis of a cylinder; zero for spheres.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
};

/// Consensus and refinement, the same for both.
bool
solve(const ModelPtr& model,
      double threshold,
      pcl::Indices& inliers,
      Eigen::VectorXf& coefficients)
{
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, threshold);
  if (!ransac.computeModel() || !ransac.refineModel())
    return false;
  ransac.getInliers(inliers);
  ransac.getModelCoefficients(coefficients);
  return true;
}

void
limitRadius(pcl::SampleConsensusModel<pcl::PointXYZ>& model, const Subject& subject)
{
  model.setRadiusLimits(0.2 * subject.radius_m, 5.0 * subject.radius_m);
}

std::optional<Estimate>
ours(const Subject& subject, const View& view, const Cloud::Ptr& cloud)
{
  auto model =
      pcl::make_shared<SampleConsensusModelPatch<pcl::PointXYZ>>(subject.request,
                                                                 cloud);
  model->setNoiseModel(view.noise);
  model->setSensorPose(view.sensor_pose);
  limitRadius(*model, subject);
  pcl::Indices inliers;
  Eigen::VectorXf coefficients;
  if (!solve(model, kThresholdSigmas, inliers, coefficients))
    return std::nullopt;
  const FitResult fit = model->estimatePatch(inliers, coefficients);
  if (!isUsable(fit.status))
    return std::nullopt;
  if (subject.surface == SurfaceType::Plane)
    return Estimate{0.0, std::nan(""), fit.patch.normal()};
  const int k = boundaryParameterCount(fit.patch.type.boundary);
  return Estimate{std::abs(fit.patch.kappa[0]),
                  std::sqrt(fit.covariance(k, k)),
                  subject.surface == SurfaceType::Sphere ?
                      Eigen::Vector3d::Zero() :
                      Eigen::Vector3d(fit.patch.pose().R.col(0))};
}

Normals::Ptr
normalsOf(const Cloud::Ptr& cloud)
{
  auto normals = pcl::make_shared<Normals>();
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setKSearch(kNormalNeighbors);
  estimation.compute(*normals);
  return normals;
}

/// PCL's model of the subject, with the normals that its cylinder needs.
ModelPtr
pclModel(const Subject& subject, const Cloud::Ptr& cloud)
{
  ModelPtr model;
  if (subject.surface == SurfaceType::Plane)
    model = pcl::make_shared<pcl::SampleConsensusModelPlane<pcl::PointXYZ>>(cloud);
  else if (subject.surface == SurfaceType::Sphere)
    model = pcl::make_shared<pcl::SampleConsensusModelSphere<pcl::PointXYZ>>(cloud);
  else {
    auto cylinder =
        pcl::make_shared<pcl::SampleConsensusModelCylinder<pcl::PointXYZ, pcl::Normal>>(
            cloud);
    cylinder->setInputNormals(normalsOf(cloud));
    cylinder->setNormalDistanceWeight(0.1); // as in PCL's tutorial
    model = cylinder;
  }
  limitRadius(*model, subject);
  return model;
}

std::optional<Estimate>
pclEstimate(const Subject& subject, const Eigen::VectorXf& coefficients)
{
  switch (subject.surface) {
  case SurfaceType::Plane:
    return Estimate{0.0, std::nan(""), coefficients.head<3>().cast<double>()};
  case SurfaceType::Sphere:
    return Estimate{1.0 / coefficients[3], std::nan(""), Eigen::Vector3d::Zero()};
  default:
    return Estimate{1.0 / coefficients[6],
                    std::nan(""),
                    coefficients.segment<3>(3).cast<double>()};
  }
}

std::optional<Estimate>
pclConsensus(const Subject& subject, const View&, const Cloud::Ptr& cloud)
{
  pcl::Indices inliers;
  Eigen::VectorXf coefficients;
  if (!solve(pclModel(subject, cloud), kThreshold, inliers, coefficients))
    return std::nullopt;
  return pclEstimate(subject, coefficients);
}

/// The best that PCL can do: its least squares over all points, from the truth.
std::optional<Estimate>
pclLeastSquares(const Subject& subject, const View& view, const Cloud::Ptr& cloud)
{
  const ModelPtr model = pclModel(subject, cloud);
  Eigen::VectorXf coefficients =
      PatchConsensus(subject.request).coefficientsOf(view.patch);
  model->optimizeModelCoefficients(*model->getIndices(), coefficients, coefficients);
  return pclEstimate(subject, coefficients);
}

/// At the point in the middle, from all points.
std::optional<Estimate>
pclCurvatures(const Subject& subject, const View& view, const Cloud::Ptr& cloud)
{
  const Normals::Ptr normals = normalsOf(cloud);
  const auto distance = [&view](const pcl::PointXYZ& p) {
    return (p.getVector3fMap().cast<double>() - view.patch.c).squaredNorm();
  };
  const auto middle =
      std::min_element(cloud->begin(), cloud->end(), [&](const auto& a, const auto& b) {
        return distance(a) < distance(b);
      });
  pcl::PrincipalCurvaturesEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setInputNormals(normals);
  estimation.setIndices(
      pcl::make_shared<pcl::Indices>(1, static_cast<int>(middle - cloud->begin())));
  estimation.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setRadiusSearch(2.0 * subject.radius_m);
  pcl::PointCloud<pcl::PrincipalCurvatures> curvatures;
  estimation.compute(curvatures);
  if (curvatures.size() != 1 || !std::isfinite(curvatures[0].pc1))
    return std::nullopt;
  Estimate estimate;
  estimate.curvature = curvatures[0].pc1;
  return estimate;
}

struct Method {
  const char* name;
  std::optional<Estimate> (*run)(const Subject&, const View&, const Cloud::Ptr&);
  bool gives_radius;
};

constexpr std::array<Method, 4> kMethods{{
    {"holdfast", ours, true},
    {"pcl ransac", pclConsensus, true},
    {"pcl least squares", pclLeastSquares, true},
    {"pcl principal curvatures", pclCurvatures, false},
}};

struct Trial {
  std::optional<Estimate> estimate;
  double microseconds = 0.0;
};

/// Mean and standard deviation of values.
MeanAndVariance
momentsOf(const std::vector<double>& values)
{
  const auto n = static_cast<double>(values.size());
  MeanAndVariance m{n > 0.0 ? 0.0 : std::nan(""), 0.0};
  for (const double v : values)
    m.mean += v / n;
  for (const double v : values)
    m.variance += (v - m.mean) * (v - m.mean) / (n - 1.0);
  return m;
}

Json
rowOf(const Subject& subject,
      const View& view,
      const Method& method,
      const std::vector<Trial>& trials)
{
  const bool flat = subject.surface == SurfaceType::Plane;
  const Eigen::Vector3d direction =
      flat ? view.patch.normal() : Eigen::Vector3d(view.patch.pose().R.col(0));
  std::vector<double> radii, curvatures, sigmas;
  double microseconds = 0.0, angle_squares = 0.0;
  bool has_direction = false;
  for (const Trial& trial : trials) {
    microseconds += trial.microseconds / static_cast<double>(trials.size());
    if (!trial.estimate)
      continue;
    const Estimate& e = *trial.estimate;
    curvatures.push_back(e.curvature);
    radii.push_back(1.0 / e.curvature);
    sigmas.push_back(e.curvature_sigma / (e.curvature * e.curvature));
    has_direction = has_direction || !e.direction.isZero();
    const double sine = e.direction.normalized().cross(direction).norm();
    angle_squares += std::pow(std::asin(std::min(1.0, sine)), 2);
  }
  const MeanAndVariance radius = momentsOf(radii), curvature = momentsOf(curvatures);
  const double sigma = momentsOf(sigmas).mean;
  const auto where = [](bool applies, double value) {
    return applies && std::isfinite(value) ? Json(value) : Json();
  };
  const bool round = !flat && method.gives_radius;
  const auto n = static_cast<double>(curvatures.size());
  return {{"surface", surfaceName(subject.surface)},
          {"points", view.truth.size()},
          {"method", method.name},
          {"true_radius_mm", where(!flat, 1e3 * subject.radius_m)},
          {"radius_bias_mm", where(round, 1e3 * (radius.mean - subject.radius_m))},
          {"radius_spread_mm", where(round, 1e3 * std::sqrt(radius.variance))},
          {"predicted_sigma_mm", where(round, 1e3 * sigma)},
          {"true_curvature", flat ? 0.0 : 1.0 / subject.radius_m},
          {"curvature", where(!flat || !method.gives_radius, curvature.mean)},
          {"curvature_spread",
           where(!flat || !method.gives_radius, std::sqrt(curvature.variance))},
          {"angle_rms_deg",
           where(has_direction, std::sqrt(angle_squares / n) * 180.0 / kPi)},
          {"failures", trials.size() - curvatures.size()},
          {"microseconds", microseconds}};
}

/// Bias and spread of the radii, in mm.
Plot
plotOf(const std::vector<Json>& rows)
{
  Panel panel;
  panel.title = "Radii from the same points";
  panel.y = {"error of the radius (mm)"};
  for (const Method& method : kMethods) {
    Series series{method.name, {}, {}, SeriesStyle::Markers};
    for (const Json& row : rows) {
      if (row["method"] != method.name || row["radius_bias_mm"].is_null())
        continue;
      const std::string name = row["surface"].get<std::string>() + " " +
                               formatNumber("%.0f mm", row["true_radius_mm"]);
      auto& names = panel.x.categories;
      const auto at = std::find(names.begin(), names.end(), name);
      series.x.push_back(static_cast<double>(at - names.begin()));
      if (at == names.end())
        names.push_back(name);
      series.y.push_back(row["radius_bias_mm"]);
    }
    if (!series.x.empty())
      panel.series.push_back(series);
  }
  return {{panel}, 1};
}

std::vector<Column>
columns()
{
  return {{"surface", "surface"},
          {"R (mm)", "true_radius_mm"},
          {"points", "points"},
          {"method", "method"},
          {"bias (mm)", "radius_bias_mm"},
          {"spread (mm)", "radius_spread_mm"},
          {"predicted", "predicted_sigma_mm"},
          {"true curvature", "true_curvature"},
          {"curvature", "curvature"},
          {"spread", "curvature_spread"},
          {"angle rms (deg)", "angle_rms_deg"},
          {"failures", "failures"},
          {"us", "microseconds"}};
}

Report
run(const ExperimentSettings& settings)
{
  // PCL reports every sample that makes no cylinder.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  Report report;
  const int stages = static_cast<int>(kSubjects.size());
  for (int stage = 0; stage < stages; ++stage) {
    const Subject& subject = kSubjects[static_cast<std::size_t>(stage)];
    const View view = viewOf(subject);
    std::array<std::vector<Trial>, kMethods.size()> trials;
    for (auto& of_method : trials)
      of_method.resize(static_cast<std::size_t>(settings.trials));
    parallelFor(
        settings.trials,
        settings.threads,
        [&](int i, int) {
          auto generator = trialGenerator(settings.seed, static_cast<std::uint64_t>(i));
          const Cloud::Ptr cloud = draw(view, generator);
          for (std::size_t m = 0; m < kMethods.size(); ++m) {
            const Stopwatch watch;
            Trial& trial = trials[m][static_cast<std::size_t>(i)];
            trial.estimate = kMethods[m].run(subject, view, cloud);
            trial.microseconds = 1e3 * watch.milliseconds();
          }
        },
        stageProgress(settings.progress, stage, stages));
    for (std::size_t m = 0; m < kMethods.size(); ++m)
      report.rows.push_back(rowOf(subject, view, kMethods[m], trials[m]));
  }
  report.columns = columns();
  report.remarks = {
      "Patches of a Kinect's noise seen from 1 m, tilted by 0.5 rad. Both go through "
      "pcl::RandomSampleConsensus and refineModel(), ours at 3 sigmas, PCL's at the "
      "same distance in metres; PCL's cylinder needs normals, of 20 neighbours each. "
      "The least squares are PCL's over all points, from the true surface. "
      "Bias and spread are of the trials that did not fail, times of the whole way.",
      "PCL's principal curvatures are eigenvalues of a scatter of unit normals, which "
      "has no unit: a surface of half the radius, seen over half the length, has twice "
      "the curvature and nearly the same eigenvalue."};
  report.plot = plotOf(report.rows);
  return report;
}

}} // namespace holdfast::app

void
holdfastCompareWithPcl(const holdfast::app::ExperimentSettings& settings,
                       holdfast::app::Report& report)
{
  report = holdfast::app::run(settings);
}
