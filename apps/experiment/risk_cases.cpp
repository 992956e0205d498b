#include "risk_cases.h"

#include "scene.h"
#include "spots.h"

#include "parallel/parallel_for.h"

#include <holdfast/evaluation/contact_referee.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/simulation/trajectory.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <cmath>
#include <optional>

namespace holdfast::app {
namespace {

/// Increments of odometry: 1 mrad and 2 mm.
constexpr double kSigmaRad = 1e-3, kSigmaM = 2e-3;

double
logUniform(double low, double high, std::mt19937_64& generator)
{
  return std::exp(uniformBetween(std::log(low), std::log(high), generator));
}

/// A sole that the support of a patch may cover, with tolerances from strict to loose.
Foot
randomFoot(double radius_m, std::mt19937_64& generator)
{
  Foot foot = rectangularFoot(radius_m * uniformBetween(0.6, 1.2, generator),
                              radius_m * uniformBetween(0.4, 0.8, generator));
  foot.friction = {uniformBetween(0.1, 0.7, generator),
                   uniformBetween(0.0, 0.1, generator)};
  foot.tolerances.height_m = logUniform(3e-4, 2e-2, generator);
  foot.tolerances.gap_m = logUniform(5e-4, 2e-2, generator);
  return foot;
}

/// A map and where its frame lies in the world.
struct SeenMap {
  const PatchMap& map;
  Pose in_world;
  SurfacePrior prior;

  SeenMap(const PatchMap& seen, const Pose& where)
  : map(seen), in_world(where), prior(surfacePriorOf(seen, down()))
  {}

  /// Gravity, frame of the map.
  Eigen::Vector3d down() const
  {
    return -in_world.R.row(2).transpose();
  }
};

Placement
randomPlacement(const SeenMap& seen,
                const ContactSurface& surface,
                std::mt19937_64& generator)
{
  const double u = surface.radius_m * uniformBetween(-0.3, 0.3, generator);
  const double v = surface.radius_m * uniformBetween(-0.3, 0.3, generator);
  Placement placement;
  placement.point = surface.anchor.toWorld({u, v, surface.jet.height(u, v)});
  placement.load_direction = seen.down();
  placement.yaw = uniformBetween(-3.0, 3.0, generator);
  return placement;
}

/// What happens at a placement that was judged so.
std::optional<RiskCase>
happened(const Scene& scene,
         const SeenMap& seen,
         const Foot& foot,
         const Placement& placement,
         std::mt19937_64& generator)
{
  const Pose load = seen.in_world * loadFrame(placement);
  const std::optional<TrueContact> truth = trueContact(scene, foot, load);
  const double mu = drawFriction(foot.friction, generator);
  if (!truth)
    return std::nullopt;
  RiskCase result;
  result.slipped = truth->slope.norm() > mu;
  result.was_off_height = std::abs(truth->height_m) > foot.tolerances.height_m;
  result.gaped = truth->gap_m > foot.tolerances.gap_m;
  return result;
}

/// A foot, a place, and what was said of it.
struct Judged {
  Placement placement;
  ContactEvents risk;
};

std::optional<Judged>
judge(const SeenMap& seen,
      const MapPatch& patch,
      const Foot& foot,
      std::mt19937_64& generator)
{
  const ContactSurface surface = contactSurfaceOf(seen.map, patch, seen.prior);
  const Placement placement = randomPlacement(seen, surface, generator);
  const ContactRisk risk = contactRisk(surface, foot, placement);
  if (!risk.quality)
    return std::nullopt;
  return Judged{placement, risk.quality->risk};
}

/// One foot after the other on patches seen in the last frame.
std::vector<RiskCase>
casesOn(const Scene& scene, const SeenMap& seen, std::mt19937_64& generator)
{
  std::vector<RiskCase> cases;
  for (const MapPatch& patch : seen.map.patches()) {
    if (patch.last_seen != seen.map.frames())
      continue;
    const Foot foot = randomFoot(patch.radius_m, generator);
    const std::optional<Judged> judged = judge(seen, patch, foot, generator);
    if (!judged)
      continue;
    if (auto result = happened(scene, seen, foot, judged->placement, generator)) {
      result->predicted = judged->risk;
      cases.push_back(*result);
    }
  }
  return cases;
}

/// What another map says of a place, by its patch that is nearest.
std::optional<ContactEvents>
judgeAgain(const SeenMap& again, const Foot& foot, const Placement& placement)
{
  const PatchMap& map = again.map;
  const MapPatch* nearest = nullptr;
  double distance = 0.5 * map.options().radius_m;
  for (const MapPatch& patch : map.patches())
    if (const double d = (patch.anchor.c - placement.point).norm(); d < distance) {
      nearest = &patch;
      distance = d;
    }
  if (nearest == nullptr)
    return std::nullopt;
  const ContactRisk risk =
      contactRisk(contactSurfaceOf(map, *nearest, again.prior), foot, placement);
  return risk.quality ? std::optional(risk.quality->risk) : std::nullopt;
}

/// The best of every so many places, and what another view of them says.
std::vector<ChosenCase>
chooseOn(const Scene& scene,
         const SeenMap& seen,
         const SeenMap& again,
         int choose_from,
         std::mt19937_64& generator)
{
  std::vector<ChosenCase> chosen;
  const std::vector<MapPatch>& patches = seen.map.patches();
  for (int round = 0; round < static_cast<int>(patches.size()) / choose_from; ++round) {
    const Foot foot = randomFoot(seen.map.options().radius_m, generator);
    std::optional<Judged> best;
    for (int i = 0; i < choose_from; ++i) {
      std::uniform_int_distribution<std::size_t> any(0, patches.size() - 1);
      const auto judged = judge(seen, patches[any(generator)], foot, generator);
      if (judged && (!best || judged->risk.total < best->risk.total))
        best = judged;
    }
    if (!best)
      continue;
    const auto other = judgeAgain(again, foot, best->placement);
    auto result = happened(scene, seen, foot, best->placement, generator);
    if (!other || !result)
      continue;
    result->predicted = best->risk;
    chosen.push_back({*result, probabilityOfAny(*other)});
  }
  return chosen;
}

template <typename T>
void
append(const std::vector<T>& more, std::vector<T>& all)
{
  all.insert(all.end(), more.begin(), more.end());
}

/// The camera, its walk, and the map of all frames so far.
class Walker {
public:
  explicit Walker(const RiskWalk& walk)
  : walk_(walk)
  , sensor_(walk.sensor)
  , scene_(makeScene(walk.scene))
  , generator_(trialGenerator(walk.seed, walk.pattern ? 1 : 0))
  {
    if (!walk.pattern)
      sensor_.pattern.waves.clear();
    PatchMapOptions map_options;
    map_options.radius_m = walk.radius_m;
    map_options.max_depth_change = walk.max_depth_change;
    options_.map = mapOptionsFor(sensor_, map_options);
    options_.extraction.threads = walk.threads;
    WalkOptions way;
    way.step_m = walk.step_m;
    truth_ = holdfast::walk(scene_, walk.frames, way);
    odometry_ = noisyOdometry(truth_, kSigmaRad, kSigmaM, generator_);
  }

  RiskOutcome run()
  {
    const FrameSimulator camera(scene_,
                                pixelRays(sensor_.camera, walk_.stride),
                                sensor_,
                                SimulationOptions(),
                                PatternOverTime::Fixed,
                                walk_.seed);
    FrameMapper mapper(sensor_, options_);
    for (std::size_t k = 0; k < truth_.size(); ++k) {
      const RangeImage image = camera.truth(truth_[k]);
      const auto noisy = [&](std::size_t noise) {
        return cloudOf(inSensorFrame(camera.withNoise(static_cast<int>(noise), image)));
      };
      const RangeCloud frame = noisy(k);
      add(mapper, frame, k);
      const PatchMap& map = mapper.map();
      const SeenMap seen(map, truth_[k] * map.pose().inverse());
      append(casesOn(scene_, seen, generator_), outcome_.fused);
      addSingle(frame, noisy(k + truth_.size()), truth_[k]);
      walk_.progress(static_cast<int>(k) + 1, walk_.frames);
    }
    return std::move(outcome_);
  }

private:
  void add(FrameMapper& mapper, const RangeCloud& frame, std::size_t k) const
  {
    if (k == 0) {
      mapper.addStill(frame);
      return;
    }
    Motion motion{odometry_.increments[k - 1], JetMatrix::Zero()};
    motion.covariance.diagonal() << Eigen::Vector3d::Constant(kSigmaRad * kSigmaRad),
        Eigen::Vector3d::Constant(kSigmaM * kSigmaM);
    mapper.add(frame, motion);
  }

  void addSingle(const RangeCloud& frame, const RangeCloud& again, const Pose& truth)
  {
    FrameMapper one(sensor_, options_), other(sensor_, options_);
    one.addStill(frame);
    other.addStill(again);
    const SeenMap seen(one.map(), truth), seen_again(other.map(), truth);
    append(casesOn(scene_, seen, generator_), outcome_.single);
    append(chooseOn(scene_, seen, seen_again, walk_.choose_from, generator_),
           outcome_.chosen);
  }

  const RiskWalk& walk_;
  Sensor sensor_;
  Scene scene_;
  std::mt19937_64 generator_;
  MappingOptions options_;
  std::vector<Pose> truth_;
  Odometry odometry_;
  RiskOutcome outcome_;
};

} // namespace

double
probabilityOfAny(const ContactEvents& events)
{
  const double seen = 1.0 - events.support; // contactRisk() answers for more than none
  return 1.0 - (1.0 - events.joint) / seen;
}

RiskOutcome
riskWalk(const RiskWalk& walk)
{
  RiskOutcome outcome = Walker(walk).run();
  for (std::vector<RiskCase>* cases : {&outcome.single, &outcome.fused})
    for (RiskCase& c : *cases)
      c.walk = walk.seed;
  for (ChosenCase& c : outcome.chosen)
    c.chosen.walk = walk.seed;
  return outcome;
}

} // namespace holdfast::app
