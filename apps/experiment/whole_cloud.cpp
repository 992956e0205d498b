#include "whole_cloud.h"

#include "consistency_rows.h"
#include "scene.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/simulation/scene.h>
#include <holdfast/simulation/simulator.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include "evaluation/fit_error.h"
#include "pcl/point_gatherer.h"
#include "pcl/point_selection.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace holdfast::app {
namespace {

/// The scene as a camera sees it that looks at its middle from somewhere.
Scene
viewOf(const std::string& name, std::mt19937_64& generator)
{
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(generator);
  };
  const double distance = uniform(1.0, 1.2);
  const double azimuth = uniform(0.0, 2.0 * kPi), elevation = uniform(0.52, 1.1);
  Scene scene = makeScene(name, distance);
  const Eigen::Vector3d middle = scene.sensor_pose.toWorld({0.0, 0.0, distance});
  const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth),
                                  std::sin(elevation));
  scene.sensor_pose =
      lookAt(middle + distance * direction, middle, Eigen::Vector3d::UnitZ());
  return scene;
}

/// The noise-free fits of one frame.
class Referee {
public:
  Referee(const RangeImage& image,
          const RangeCloud& cloud,
          const Sensor& sensor,
          const ExtractionOptions& options)
  : image_(image)
  , chosen_(selectPoints(cloud, sensor))
  , sampler_(chosen_.cloud, chosen_.sensor, options.sampler)
  , scratch_(sampler_.makeScratch())
  , gatherer_(chosen_.cloud, chosen_.sensor, options.fit.noise_at_surface)
  , estimator_(withoutDebiasing(options.fit), options.covariance)
  {}

  /// Of the pixels of a patch.
  FitResult fitFor(const ExtractedPatch& patch)
  {
    if (patch.is_second_attempt)
      sampler_.strictNeighborhood(patch.seed_index.value(), *scratch_, indices_);
    else
      sampler_.neighborhood(patch.seed_index.value(), *scratch_, indices_);
    gatherer_.gather(indices_, patch.seed, batch_);
    takeTruth(image_, indices_, batch_);
    return estimator_.estimate(batch_);
  }

private:
  /// The scatter of points without noise has none to subtract.
  static FitOptions withoutDebiasing(FitOptions fit)
  {
    fit.debias_scatter = false;
    return fit;
  }

  const RangeImage& image_;
  PointSelection chosen_;
  NeighborhoodSampler sampler_;
  NeighborhoodSampler::ScratchPtr scratch_;
  PointGatherer gatherer_;
  PatchEstimator estimator_;
  std::vector<int> indices_;
  PointBatch batch_;
};

void
add(RobustTally& tally, const NormalizedError& error)
{
  constexpr double kFar = 100.0; // NEES/dof
  if (error.nees_per_dof > kFar)
    ++tally.far;
  else
    holdfast::add(tally.near, error);
}

void
add(RobustTally& tally, const RobustTally& other)
{
  holdfast::add(tally.near, other.near);
  tally.far += other.far;
}

int
countOf(const RobustTally& tally)
{
  return tally.near.count + tally.far;
}

/// How far the patch is turned about its normal from the reference, rad.
double
turnBetween(const Patch& patch, const Patch& reference)
{
  const Eigen::Matrix3d turn = expMap(reference.r).transpose() * expMap(patch.r);
  return std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
}

/// The parameters of a patch without a flag. Round patches have no axes, and all but
/// quads are the same after half a turn, which of the two comes out is chance.
void
judgeParameters(const FitResult& fit, Patch reference, CloudTally& tally)
{
  constexpr double kQuarter = 0.7853981633974483; // of pi
  if (layoutOf(reference.type).r_count == 3) {
    double turn = turnBetween(fit.patch, reference);
    if (std::abs(turn) > 3.0 * kQuarter &&
        reference.type.boundary != BoundaryType::Quad) {
      reference.r = logMap(expMap(reference.r) * expMap({0.0, 0.0, 4.0 * kQuarter}));
      turn = turnBetween(fit.patch, reference);
    }
    if (std::abs(turn) > kQuarter) {
      ++tally.switched;
      return;
    }
  }
  add(tally.parameters, parameterError(fit, reference));
}

void
judge(const FitResult& fit, const FitResult& reference, CloudTally& tally)
{
  if (!isUsable(reference.status)) {
    ++tally.no_reference;
    return;
  }
  if (fit.patch.type != reference.patch.type) {
    ++tally.other_type;
    return;
  }
  const bool flagged = fit.flags.any();
  const NormalizedError state = stateError(fit, reference.state);
  add(tally.state, state);
  add(flagged ? tally.flagged_state : tally.unflagged_state, state);
  add(tally.surface, surfaceError(fit, reference.state));
  if (flagged)
    ++tally.flagged;
  else
    judgeParameters(fit, reference.patch, tally);
  tally.points += fit.points;
}

int
indexOf(PatchType type)
{
  return static_cast<int>(std::find(kPatchTypes.begin(), kPatchTypes.end(), type) -
                          kPatchTypes.begin());
}

CloudCheck
checkFrame(const RangeImage& image,
           const RangeCloud& cloud,
           const Sensor& sensor,
           const ExtractionOptions& options)
{
  const ExtractionResult result = extractPatches(cloud, sensor, options);
  Referee referee(image, cloud, sensor, options);
  CloudCheck check;
  check.radius_m = options.sampler.radius_m;
  check.frames = 1;
  for (const auto& [status, count] : result.rejected)
    check.failures += count;
  for (const auto& [verdict, count] : result.turned_down)
    check.failures += count;
  check.seeds = static_cast<int>(result.patches.size()) + check.failures;
  check.truth =
      compareWithTruth(image, sensor, result.patches, options.sampler.radius_m);
  for (const ExtractedPatch& patch : result.patches)
    judge(patch.fit, referee.fitFor(patch), check.types[indexOf(patch.fit.patch.type)]);
  return check;
}

/// One frame at every radius.
std::vector<CloudCheck>
checkFrames(int frame,
            const std::vector<double>& radii_m,
            const Sensor& sensor,
            const CloudCheckOptions& options)
{
  std::mt19937_64 generator =
      trialGenerator(options.seed, static_cast<std::uint64_t>(frame));
  const RangeImage image = simulate(viewOf(options.scene, generator),
                                    pixelRays(sensor.camera),
                                    sensor,
                                    {},
                                    generator);
  RangeCloud cloud = cloudOf(image);
  cloud.sensor_pose_given = true;
  ExtractionOptions extraction;
  extraction.fit = options.fit;
  extraction.covariance = options.mode;
  extraction.validation.emplace();
  extraction.threads = 1;
  std::vector<CloudCheck> checks;
  for (const double radius : radii_m) {
    extraction.sampler.radius_m = radius;
    checks.push_back(checkFrame(image, cloud, sensor, extraction));
  }
  return checks;
}

void
addTo(CloudTally& all, const CloudTally& one)
{
  add(all.state, one.state);
  add(all.unflagged_state, one.unflagged_state);
  add(all.flagged_state, one.flagged_state);
  add(all.surface, one.surface);
  add(all.parameters, one.parameters);
  all.flagged += one.flagged;
  all.switched += one.switched;
  all.other_type += one.other_type;
  all.no_reference += one.no_reference;
  all.points += one.points;
}

void
addTo(CloudCheck& all, const CloudCheck& one)
{
  all.radius_m = one.radius_m;
  all.frames += one.frames;
  all.seeds += one.seeds;
  all.failures += one.failures;
  all.truth += one.truth;
  for (const auto& [type, tally] : one.types)
    addTo(all.types[type], tally);
}

Json
share(int part, int whole)
{
  return whole > 0 ? Json(static_cast<double>(part) / whole) : Json();
}

Json
nees(const RobustTally& tally)
{
  return value(tally.near, &ErrorTally::nees_per_dof);
}

/// Those far off are outside.
Json
coverage(const RobustTally& tally)
{
  const int all = countOf(tally);
  return all > 0 ? Json(tally.near.coverage95 * tally.near.count / all) : Json();
}

Json
rowOf(const CloudCheck& check, const std::string& type, const CloudTally& tally)
{
  const int judged = countOf(tally.state);
  return {{"radius_m", check.radius_m},
          {"type", type},
          {"trials", check.frames},
          {"points", judged > 0 ? Json(tally.points / judged) : Json()},
          {"patches", judged},
          {"far", tally.state.far},
          {"state_nees_per_dof", nees(tally.state)},
          {"state_coverage95", coverage(tally.state)},
          {"unflagged_state_nees_per_dof", nees(tally.unflagged_state)},
          {"unflagged_state_coverage95", coverage(tally.unflagged_state)},
          {"flagged_state_nees_per_dof", nees(tally.flagged_state)},
          {"flagged_state_coverage95", coverage(tally.flagged_state)},
          {"surface_nees_per_dof", nees(tally.surface)},
          {"surface_coverage95", coverage(tally.surface)},
          {"unflagged_nees_per_dof", nees(tally.parameters)},
          {"unflagged_coverage95", coverage(tally.parameters)},
          {"unflagged_rate", share(judged - tally.flagged, judged)},
          {"flagged", tally.flagged},
          {"switch_rate", share(tally.switched, judged - tally.flagged)},
          {"other_type", tally.other_type},
          {"no_reference", tally.no_reference},
          {"type_error_rate", share(tally.other_type, judged + tally.other_type)}};
}

} // namespace

std::vector<CloudCheck>
checkClouds(const std::vector<double>& radii_m,
            const Sensor& sensor,
            const CloudCheckOptions& options)
{
  std::vector<std::vector<CloudCheck>> frames(static_cast<std::size_t>(options.frames));
  parallelFor(
      options.frames,
      options.threads,
      [&](int frame, int) {
        frames[static_cast<std::size_t>(frame)] =
            checkFrames(frame, radii_m, sensor, options);
      },
      options.progress);
  std::vector<CloudCheck> checks(radii_m.size());
  for (const std::vector<CloudCheck>& frame : frames)
    for (std::size_t i = 0; i < checks.size(); ++i)
      addTo(checks[i], frame[i]);
  return checks;
}

std::vector<Json>
rowsOf(const CloudCheck& check)
{
  CloudTally all;
  for (const auto& [type, tally] : check.types)
    addTo(all, tally);
  std::vector<Json> rows{rowOf(check, "all", all)};
  rows.front()["seeds"] = check.seeds;
  rows.front()["failure_rate"] = share(check.failures, check.seeds);
  const TruthTally& truth = check.truth;
  rows.front()["over_edge"] = share(truth.over_edge, truth.patches);
  rows.front()["covered"] = share(truth.covered_pixels, truth.smooth_pixels);
  for (const auto& [type, tally] : check.types)
    rows.push_back(
        rowOf(check, typeName(kPatchTypes[static_cast<std::size_t>(type)]), tally));
  return rows;
}

} // namespace holdfast::app
