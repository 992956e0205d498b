#include "map_walk.h"

#include "console.h"
#include "scene.h"

#include "parallel/parallel_for.h"

#include <holdfast/evaluation/spot_view.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/simulation/trajectory.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

namespace holdfast::app {
namespace {

/// A patch when it was last seen.
struct Sighting {
  std::size_t frame = 0;
  Pose in_sensor; ///< its anchor
  JetVector jet;
  JetMatrix covariance;
  double radius_m = 0.0, first_sigma_m = 0.0;
  int views = 0;
};

Sensor
sensorOf(const WalkRule& rule, Sensor sensor)
{
  if (!rule.pattern)
    sensor.pattern.waves.clear();
  return sensor;
}

MappingOptions
mappingOptions(const Sensor& sensor, int threads)
{
  MappingOptions options;
  options.map = mapOptionsFor(sensor);
  options.extraction.threads = threads;
  return options;
}

JetMatrix
incrementCovariance(double sigma_rad, double sigma_m)
{
  JetVector variance;
  variance << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variance.asDiagonal();
}

/// Time that a map takes for one frame, apart from the fits: on a copy.
double
updateMilliseconds(PatchMap map, const FrameReport& report, const Camera& camera)
{
  std::vector<Measurement> measurements;
  for (const ExtractedPatch& patch : report.extraction.patches)
    if (auto m = measurementOf(patch.fit)) {
      m->id = measurements.size() + 1;
      measurements.push_back(*m);
    }
  const Stopwatch watch;
  map.move(Pose(), incrementCovariance(1e-4, 1e-4));
  (void)map.wantedSeeds(camera);
  map.update(measurements);
  return watch.milliseconds();
}

/// One map on its way.
class Walker {
public:
  Walker(const WalkRule& rule,
         const WalkSettings& settings,
         const std::vector<Pose>& truth,
         const Odometry& odometry)
  : rule_(rule)
  , settings_(settings)
  , truth_(truth)
  , odometry_(odometry)
  , sensor_(sensorOf(rule, settings.sensor))
  , mapper_(sensor_, mappingOptions(sensor_, settings.threads))
  , camera_(Scene(makeScene(settings.scene)),
            pixelRays(sensor_.camera, settings.stride),
            sensor_,
            SimulationOptions(),
            PatternOverTime::Fixed,
            settings.seed)
  {}

  const FrameSimulator& camera() const
  {
    return camera_;
  }

  /// \param seen FrameSimulator::truth() at the true pose of frame k.
  void take(std::size_t k, const RangeImage& seen)
  {
    if (!outcome_.failure.empty())
      return;
    const RangeCloud cloud =
        cloudOf(inSensorFrame(camera_.withNoise(static_cast<int>(k), seen)));
    const Pose before = mapper_.map().pose();
    const Stopwatch watch;
    FrameReport report;
    try {
      report = map(k, cloud);
    }
    catch (const std::invalid_argument& error) {
      outcome_.failure = error.what(); // a row of the table, not its end
      return;
    }
    addFrame(k, before, report, watch.milliseconds());
    record(k);
  }

  WalkOutcome finish(const Scene& scene)
  {
    std::vector<Sighting> kept;
    for (const MapPatch& patch : mapper_.map().patches())
      if (const auto found = sightings_.find(patch.id); found != sightings_.end())
        kept.push_back(found->second);
    outcome_.patches.resize(kept.size());
    parallelFor(static_cast<int>(kept.size()), settings_.threads, [&](int i, int) {
      const auto at = static_cast<std::size_t>(i);
      outcome_.patches[at] = errorOf(kept[at], scene);
    });
    return std::move(outcome_);
  }

private:
  FrameReport map(std::size_t k, const RangeCloud& cloud)
  {
    if (rule_.poses == WalkPoses::Registration)
      return mapper_.addUnknown(cloud);
    if (k == 0)
      return mapper_.addStill(cloud);
    if (rule_.poses == WalkPoses::Known)
      return mapper_.add(
          cloud,
          {truth_[k - 1].inverse() * truth_[k], 1e-18 * JetMatrix::Identity()});
    return mapper_.add(cloud,
                       {odometry_.increments[k - 1],
                        incrementCovariance(settings_.odometry_sigma_rad,
                                            settings_.odometry_sigma_m)});
  }

  void addFrame(std::size_t k,
                const Pose& before,
                const FrameReport& report,
                double milliseconds)
  {
    WalkFrame frame;
    frame.milliseconds = milliseconds;
    constexpr std::size_t kTimed = 10; // every so many frames
    if (k % kTimed == kTimed - 1)
      frame.update_milliseconds =
          updateMilliseconds(mapper_.map(), report, report.extraction.sensor.camera);
    frame.update = report.update;
    addPose(k, frame);
    if (report.registration)
      addRegistration(k, before, *report.registration, frame);
    outcome_.frames.push_back(frame);
  }

  void addPose(std::size_t k, WalkFrame& frame) const
  {
    const Pose pose = truth_.front() * mapper_.map().pose();
    frame.way_m = static_cast<double>(k) * settings_.step_m;
    frame.position_error_m = (pose.c - truth_[k].c).norm();
    frame.rotation_error_rad = logMap(truth_[k].R.transpose() * pose.R).norm();
  }

  void addRegistration(std::size_t k,
                       const Pose& before,
                       const RegistrationResult& result,
                       WalkFrame& frame)
  {
    frame.is_lost = result.status != RegistrationStatus::Converged;
    frame.is_open = !frame.is_lost && result.null_space.cols() > 0;
    if (frame.is_lost)
      return;
    // From the last frame that was found.
    const Pose found = before.inverse() * result.pose;
    const Pose truth = truth_[last_found_].inverse() * truth_[k];
    JetVector error;
    error << logMap(truth.R.transpose() * found.R), found.c - truth.c;
    frame.squared_rad = error.head<3>().squaredNorm() / 3.0;
    frame.squared_m = error.tail<3>().squaredNorm() / 3.0;
    RegistrationResult turned = result; // c from the axes of the map
    JetMatrix T = JetMatrix::Identity();
    T.bottomRightCorner<3, 3>() = before.R.transpose();
    turned.covariance = T * result.covariance * T.transpose();
    turned.null_space = T * result.null_space;
    frame.observed = observedError(error, turned);
    last_found_ = k;
  }

  void record(std::size_t k)
  {
    const PatchMap& map = mapper_.map();
    const Pose to_sensor = map.pose().inverse();
    for (const MapPatch& patch : map.patches()) {
      if (patch.last_seen != map.frames())
        continue;
      Sighting& s = sightings_[patch.id];
      s.frame = k;
      s.in_sensor = to_sensor * patch.anchor;
      s.jet = patch.jet.value();
      s.covariance = patch.jet.covariance();
      s.radius_m = patch.radius_m;
      s.views = patch.views;
      if (patch.views == 1)
        s.first_sigma_m = std::sqrt(s.covariance(0, 0));
    }
  }

  MapPatchError errorOf(const Sighting& s, const Scene& scene) const
  {
    MapPatchError error;
    error.views = s.views;
    error.height_sigma_m = std::sqrt(s.covariance(0, 0));
    error.first_height_sigma_m = s.first_sigma_m;
    error.slope_sigma = std::sqrt(std::max(s.covariance(1, 1), s.covariance(2, 2)));
    const auto truth = bestQuadric(scene, truth_[s.frame] * s.in_sensor, s.radius_m);
    if (!truth)
      return error;
    error.residual_m = truth->residual_m;
    const JetVector e = s.jet - truth->jet;
    const auto part = [&](int first, int count) {
      return squaredInSigmas(e.segment(first, count),
                             s.covariance.block(first, first, count, count));
    };
    error.height = part(0, 1);
    error.normal = part(1, 2);
    error.curvature = part(3, 3);
    error.all = part(0, 6);
    return error;
  }

  const WalkRule& rule_;
  const WalkSettings& settings_;
  const std::vector<Pose>& truth_;
  const Odometry& odometry_;
  Sensor sensor_;
  FrameMapper mapper_;
  FrameSimulator camera_;
  std::map<std::uint64_t, Sighting> sightings_;
  std::size_t last_found_ = 0; ///< frame of which registration found the pose
  WalkOutcome outcome_;
};

} // namespace

std::vector<WalkOutcome>
walkThrough(const WalkSettings& settings, const std::vector<WalkRule>& rules)
{
  const Scene scene = makeScene(settings.scene);
  WalkOptions walk_options;
  walk_options.step_m = settings.step_m;
  const std::vector<Pose> truth = walk(scene, settings.frames, walk_options);
  std::mt19937_64 generator = trialGenerator(settings.seed, 0);
  const Odometry odometry = noisyOdometry(truth,
                                          settings.odometry_sigma_rad,
                                          settings.odometry_sigma_m,
                                          generator);
  std::vector<std::unique_ptr<Walker>> walkers;
  for (const WalkRule& rule : rules)
    walkers.push_back(std::make_unique<Walker>(rule, settings, truth, odometry));
  constexpr std::size_t kAtOnce = 8; // frames in memory
  std::vector<RangeImage> seen(kAtOnce);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (k % kAtOnce == 0)
      parallelFor(static_cast<int>(std::min(kAtOnce, truth.size() - k)),
                  settings.threads,
                  [&](int i, int) {
                    const auto at = static_cast<std::size_t>(i);
                    seen[at] = walkers.front()->camera().truth(truth[k + at]);
                  });
    for (const auto& walker : walkers)
      walker->take(k, seen[k % kAtOnce]);
    settings.progress(static_cast<int>(k) + 1, settings.frames);
  }
  std::vector<WalkOutcome> outcomes;
  for (const auto& walker : walkers)
    outcomes.push_back(walker->finish(scene));
  return outcomes;
}

} // namespace holdfast::app
