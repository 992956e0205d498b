#include "whole_cloud.h"

#include "consistency_rows.h"
#include "scene.h"
#include "truth_check.h"

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
  FitResult fitFor(const ExtractedPatch& patch, bool is_second_attempt)
  {
    if (is_second_attempt)
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

int
indexOf(PatchType type)
{
  return static_cast<int>(std::find(kPatchTypes.begin(), kPatchTypes.end(), type) -
                          kPatchTypes.begin());
}

/// Everything is measured, nothing turned down.
ValidationOptions
measuringAll()
{
  ValidationOptions options = ValidationOptions::withoutLimits();
  options.max_stray = 1.0;
  options.max_view_angle_rad = kPi;
  return options;
}

/// What came of a seed: the patch of its neighbourhood, and where any of the limits
/// asked for one, the patch of the part that is one surface with it.
struct Attempts {
  ExtractedPatch first;
  std::optional<ExtractedPatch> second;
};

/// The road of `holdfast fit` under several limits at once.
class FrameAttempts {
public:
  FrameAttempts(const RangeCloud& cloud,
                const Sensor& sensor,
                ExtractionOptions options,
                const std::vector<ValidationOptions>& limits)
  : limits_(limits), radius_m_(options.sampler.radius_m)
  {
    options.validation = measuringAll();
    options.keep_failures = true;
    for (ExtractedPatch& patch : extractPatches(cloud, sensor, options).patches)
      seeds_.push_back({std::move(patch), std::nullopt});
    addSecondAttempts(cloud, sensor, options);
  }

  const std::vector<Attempts>& seeds() const
  {
    return seeds_;
  }

  bool accepts(std::size_t limits, const ExtractedPatch& patch) const
  {
    return verdict(limits, patch) == PatchVerdict::Accepted;
  }

  /// What is not seen in the whole is not seen in a part, and a part has its noise.
  bool triesAgain(std::size_t limits, const ExtractedPatch& first) const
  {
    const PatchVerdict said = verdict(limits, first);
    return isUsable(first.fit.status) && said != PatchVerdict::Accepted &&
           said != PatchVerdict::NormalNotSeen && said != PatchVerdict::NoiseTooLarge;
  }

private:
  PatchVerdict verdict(std::size_t limits, const ExtractedPatch& patch) const
  {
    return verdictOf(*patch.validation, limits_[limits], radius_m_);
  }

  bool anyTriesAgain(const ExtractedPatch& first) const
  {
    for (std::size_t i = 0; i < limits_.size(); ++i)
      if (triesAgain(i, first))
        return true;
    return false;
  }

  void addSecondAttempts(const RangeCloud& cloud,
                         const Sensor& sensor,
                         const ExtractionOptions& options)
  {
    const PointSelection chosen = selectPoints(cloud, sensor);
    const NeighborhoodSampler sampler(chosen.cloud, chosen.sensor, options.sampler);
    const auto scratch = sampler.makeScratch(); // of one thread, as frames have
    std::vector<Attempts*> waiting;
    PatchSites sites;
    sites.seeds.emplace();
    for (Attempts& attempts : seeds_)
      if (anyTriesAgain(attempts.first)) {
        waiting.push_back(&attempts);
        sites.seeds->push_back(
            {attempts.first.seed_index.value(), attempts.first.seed});
      }
    sites.search = [&](const Seed& seed, int, std::vector<int>& indices) {
      sampler.strictNeighborhood(seed.index, *scratch, indices);
    };
    std::vector<ExtractedPatch> patches =
        extractPatches(cloud, sensor, options, sites).patches;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (isUsable(patches[i].fit.status))
        patches[i].validation->stray_share =
            sampler.strayShare((*sites.seeds)[i].index, patches[i].fit.patch);
      waiting[i]->second = std::move(patches[i]);
    }
  }

  const std::vector<ValidationOptions>& limits_;
  double radius_m_;
  std::vector<Attempts> seeds_;
};

/// One frame at one radius.
class FrameCheck {
public:
  FrameCheck(const RangeImage& image,
             const RangeCloud& cloud,
             const Sensor& sensor,
             const ExtractionOptions& options,
             const std::vector<ValidationOptions>& limits)
  : attempts_(cloud, sensor, options, limits)
  , referee_(image, cloud, sensor, options)
  , truth_(image, sensor, options.sampler.radius_m)
  , checks_(limits.size())
  , covered_(limits.size(),
             std::vector<bool>(static_cast<std::size_t>(truth_.smoothSamples())))
  {
    for (CloudCheck& check : checks_) {
      check.radius_m = options.sampler.radius_m;
      check.frames = 1;
      check.seeds = static_cast<int>(attempts_.seeds().size());
      check.smooth_samples = truth_.smoothSamples();
    }
  }

  std::vector<CloudCheck> run()
  {
    for (const Attempts& attempts : attempts_.seeds()) {
      std::vector<std::size_t> first, second; // limits that accept it
      for (std::size_t i = 0; i < checks_.size(); ++i) {
        if (attempts_.accepts(i, attempts.first))
          first.push_back(i);
        else if (attempts.second && attempts_.triesAgain(i, attempts.first) &&
                 attempts_.accepts(i, *attempts.second))
          second.push_back(i);
      }
      add(attempts.first, false, first);
      if (!second.empty())
        add(*attempts.second, true, second);
    }
    for (std::size_t i = 0; i < checks_.size(); ++i)
      checks_[i].covered_samples =
          static_cast<int>(std::count(covered_[i].begin(), covered_[i].end(), true));
    return std::move(checks_);
  }

private:
  void add(const ExtractedPatch& patch,
           bool is_second_attempt,
           const std::vector<std::size_t>& accepted_by)
  {
    if (accepted_by.empty())
      return;
    CloudTally tally;
    judge(patch.fit, referee_.fitFor(patch, is_second_attempt), tally);
    const PatchTruth truth = truth_.check(patch.fit.patch);
    for (const std::size_t i : accepted_by) {
      CloudCheck& check = checks_[i];
      ++check.accepted;
      check.over_edge += truth.over_edge ? 1 : 0;
      addTo(check.types[indexOf(patch.fit.patch.type)], tally);
      for (const int sample : truth.covered)
        covered_[i][static_cast<std::size_t>(sample)] = true;
    }
  }

  FrameAttempts attempts_;
  Referee referee_;
  TruthCheck truth_;
  std::vector<CloudCheck> checks_; ///< by limits
  std::vector<std::vector<bool>> covered_;
};

/// One frame at every radius, under all limits.
std::vector<CloudCheck>
checkFrames(int frame,
            const std::vector<double>& radii_m,
            const Sensor& sensor,
            const CloudCheckOptions& options)
{
  std::mt19937_64 generator =
      trialGenerator(options.seed, static_cast<std::uint64_t>(frame));
  const RangeImage image = simulate(randomView(options.scene, generator),
                                    pixelRays(sensor.camera),
                                    sensor,
                                    {},
                                    generator);
  RangeCloud cloud = cloudOf(image);
  cloud.sensor_pose_given = true;
  ExtractionOptions extraction;
  extraction.fit = options.fit;
  extraction.covariance = options.mode;
  extraction.threads = 1;
  std::vector<CloudCheck> checks;
  for (const double radius : radii_m) {
    extraction.sampler.radius_m = radius;
    const std::vector<CloudCheck> of_radius =
        FrameCheck(image, cloud, sensor, extraction, options.limits).run();
    checks.insert(checks.end(), of_radius.begin(), of_radius.end());
  }
  return checks;
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
  std::vector<CloudCheck> checks(radii_m.size() * options.limits.size());
  for (const std::vector<CloudCheck>& frame : frames)
    for (std::size_t i = 0; i < checks.size(); ++i)
      addTo(checks[i], frame[i]);
  return checks;
}

void
addTo(CloudCheck& all, const CloudCheck& one)
{
  all.radius_m = one.radius_m;
  all.frames += one.frames;
  all.seeds += one.seeds;
  all.accepted += one.accepted;
  all.over_edge += one.over_edge;
  all.smooth_samples += one.smooth_samples;
  all.covered_samples += one.covered_samples;
  for (const auto& [type, tally] : one.types)
    addTo(all.types[type], tally);
}

Json
summaryOf(const CloudCheck& check)
{
  CloudTally all;
  for (const auto& [type, tally] : check.types)
    addTo(all, tally);
  Json row = rowOf(check, "all", all);
  row["seeds"] = check.seeds;
  row["failure_rate"] = share(check.seeds - check.accepted, check.seeds);
  row["over_edge"] = share(check.over_edge, check.accepted);
  row["covered"] = share(check.covered_samples, check.smooth_samples);
  return row;
}

std::vector<Json>
rowsOf(const CloudCheck& check)
{
  std::vector<Json> rows{summaryOf(check)};
  for (const auto& [type, tally] : check.types)
    rows.push_back(
        rowOf(check, typeName(kPatchTypes[static_cast<std::size_t>(type)]), tally));
  return rows;
}

} // namespace holdfast::app
