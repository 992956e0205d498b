#include <holdfast/pcl/frame_mapping.h>

#include <holdfast/geometry/rotation.h>
#include <holdfast/pcl/intrinsics.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

using Clock = std::chrono::steady_clock;

ExtractionOptions
extractionFor(const MappingOptions& options, const Sensor& sensor)
{
  ExtractionOptions extraction = options.extraction;
  extraction.fit.surface = SurfaceRequest::Paraboloid;
  // Where there is none all is white, which takes no memory beside it to say.
  extraction.fit.separate_pattern = !sensor.pattern.empty();
  extraction.sampler.radius_m = options.map.radius_m;
  return extraction;
}

int
pixelIndex(const RangeCloud& frame, const Eigen::Vector2d& pixel)
{
  return static_cast<int>(std::lround(pixel.y())) *
             static_cast<int>(frame.points->width) +
         static_cast<int>(std::lround(pixel.x()));
}

/// Frame of the cloud; NaN where there is none.
Eigen::Vector3d
pointAt(const RangeCloud& frame, int index)
{
  return (*frame.points)[static_cast<std::size_t>(index)]
      .getVector3fMap()
      .cast<double>();
}

/// Of the depth of a point in the frame of the camera; 0 where nobody knows.
double
depthSigma(const Sensor& sensor, const Eigen::Vector3d& q)
{
  if (!sensor.noise || !(q.allFinite() && q.z() > 0.0))
    return 0.0;
  return std::sqrt(std::max(0.0, sensor.noise->covariance(q)(2, 2)));
}

/// Variance of what the patches say nothing of: a motion of a frame nobody has
/// measured.
JetMatrix
priorCovariance(const MappingOptions& options)
{
  JetVector variance;
  variance << Eigen::Vector3d::Constant(options.motion_sigma_rad),
      Eigen::Vector3d::Constant(options.motion_sigma_m);
  return variance.cwiseAbs2().asDiagonal();
}

/// Of the pose in the map, of (delta, c) with c in the axes of the map: what
/// registration found, and along its null space the prior.
JetMatrix
poseCovariance(const RegistrationResult& result, const JetMatrix& prior)
{
  const auto& N = result.null_space;
  if (N.cols() == 0)
    return result.covariance;
  const Eigen::MatrixXd information =
      N.transpose() * prior.diagonal().cwiseInverse().asDiagonal() * N;
  const Eigen::MatrixXd inverse =
      information.llt().solve(Eigen::MatrixXd::Identity(N.cols(), N.cols()));
  return result.covariance + N * inverse * N.transpose();
}

/// FrameMapper does not take clouds without rows and columns.
PatchMap
mapOfPoints(const RangeCloud& cloud,
            const Sensor& sensor,
            const MappingOptions& options,
            PatchMap map,
            ExtractionResult& extraction)
{
  std::vector<Measurement> measurements;
  std::mutex mutex;
  PatchSites sites;
  sites.observe =
      [&](std::size_t attempt, const ExtractedPatch& patch, const PointBatch& points) {
        auto measurement = measurementOf(patch.fit, points, cloud.sensor_pose);
        if (!measurement)
          return;
        measurement->id = attempt + 1;
        const std::lock_guard<std::mutex> lock(mutex);
        measurements.push_back(*measurement);
      };
  extraction = extractPatches(cloud, sensor, extractionFor(options, sensor), sites);
  map.update(measurements); // in whatever order
  return map;
}

bool
isFound(const RegistrationResult& result)
{
  return result.status == RegistrationStatus::Converged;
}

/// What of a limit of time (0: none) is left for a second look; nothing: too little.
std::optional<double>
timeLeft(double limit_s, Clock::time_point start)
{
  constexpr double kLeast = 0.5; // of the limit: what the first look may have taken
  const double left =
      limit_s - std::chrono::duration<double>(Clock::now() - start).count();
  if (limit_s > 0.0 && left < kLeast * limit_s)
    return std::nullopt;
  return limit_s > 0.0 ? left : 0.0;
}

/// An empty report.
FrameReport
withMemoryOf(FrameReport former)
{
  FrameReport report;
  report.extraction = std::move(former.extraction);
  return report;
}

/// The motion that goes on like this one, for so many times as long.
Pose
power(const Pose& motion, double times)
{
  return {expMap(times * logMap(motion.R)), times * motion.c};
}

} // namespace

bool
isStill(const Pose& increment)
{
  constexpr double kStill = 1e-9; // m and rad: rounding of a file
  return increment.c.norm() < kStill && increment.R.isIdentity(kStill);
}

PatchMapOptions
mapOptionsFor(const Sensor& sensor, PatchMapOptions options)
{
  if (sensor.pattern.empty())
    return options;
  options.pattern = patternReach(CorrelatedNoise(sensor.pattern), sensor.camera.fx);
  return options;
}

MappingOptions
mappingOptionsFor(const Sensor& sensor, const ExtractionOptions& extraction)
{
  MappingOptions options;
  options.extraction = extraction;
  options.map.radius_m = extraction.sampler.radius_m;
  options.map.min_radius_m = std::min(options.map.min_radius_m, options.map.radius_m);
  options.map = mapOptionsFor(sensor, options.map);
  return options;
}

FrameMapper::FrameMapper(const Sensor& sensor, const MappingOptions& options)
: FrameMapper(sensor, options, PatchMap(options.map))
{}

FrameMapper::FrameMapper(const Sensor& sensor,
                         const MappingOptions& options,
                         PatchMap map)
: sensor_(sensor), options_(options), map_(std::move(map))
{
  if (!(options.motion_sigma_rad > 0.0 && options.motion_sigma_m > 0.0))
    throw std::invalid_argument("the sigmas of a motion must be positive");
  options_.map = map_.options();
  options_.extraction = extractionFor(options_, sensor_);
}

/// Where the map wants a frame to be measured.
struct FrameMapper::Places {
  std::vector<Seed> seeds;
  std::vector<std::uint64_t> asking; ///< the patch behind each
  std::vector<std::uint64_t> seen_through;
};

void
FrameMapper::matchSensor(const RangeCloud& frame)
{
  if (!matched_ || !frame.hasSizeOf(matched_->camera))
    matched_ = matchedSensor(sensor_, frame);
}

FrameMapper::Places
FrameMapper::placesIn(const RangeCloud& frame, const Pose& sensor, FrameReport& report)
{
  Places places;
  report.hidden = report.asked = 0;
  // A frame that does not tell its camera has next to no point.
  if (!frame.hasSizeOf(matched_->camera))
    return places;
  std::vector<WantedSeed> wanted = map_.wantedSeeds(matched_->camera, sensor);
  // Those first that have waited longest, should the time not suffice for all.
  std::stable_sort(wanted.begin(),
                   wanted.end(),
                   [&](const WantedSeed& a, const WantedSeed& b) {
                     return map_.find(a.patch)->last_seen <
                            map_.find(b.patch)->last_seen;
                   });
  for (const WantedSeed& seed : wanted) {
    const int index = pixelIndex(frame, seed.pixel);
    const Eigen::Vector3d point = pointAt(frame, index);
    const Eigen::Vector3d q = frame.sensor_pose.toLocal(point);
    switch (sightOf(seed, q.z(), depthSigma(*matched_, q))) {
    case Sight::Seen:
      places.seeds.push_back({index, point});
      places.asking.push_back(seed.patch);
      break;
    case Sight::Hidden:
      ++report.hidden;
      break;
    case Sight::SeenThrough:
      places.seen_through.push_back(seed.patch);
      break;
    }
  }
  report.asked = static_cast<int>(places.seeds.size());
  return places;
}

/// \param sensor its pose, as far as it is known.
void
FrameMapper::measure(const RangeCloud& frame,
                     const Pose& sensor,
                     double max_time_s,
                     FrameReport& report)
{
  if (const std::string error = validityError(frame); !error.empty())
    throw std::invalid_argument(error);
  if (frame.points->height < 2)
    throw std::invalid_argument("a frame must be an organized cloud");
  matchSensor(frame);
  constexpr double kFree = 0.75; // of the spacing
  const double nearest =
      std::min(kFree * options_.extraction.sampler.spacing_m, options_.map.radius_m);
  const Pose to_map = sensor * frame.sensor_pose.inverse();
  Places places = placesIn(frame, sensor, report);
  measured_.seen_through = std::move(places.seen_through);
  measured_.measurements.clear();
  PatchSites sites;
  sites.first_seeds = std::move(places.seeds);
  sites.is_free = [&](const Seed& seed) {
    const Eigen::Vector3d place = to_map.toWorld(seed.position);
    return !map_.hasAnchorWithin(place, nearest) && !map_.isCovered(place);
  };
  std::mutex mutex;
  sites.observe =
      [&](std::size_t attempt, const ExtractedPatch& patch, const PointBatch& points) {
        auto m = measurementOf(patch.fit, points, frame.sensor_pose);
        if (!m)
          return;
        m->id = attempt + 1;
        m->asked_by = attempt < places.asking.size() ? places.asking[attempt] : 0;
        const std::lock_guard<std::mutex> lock(mutex);
        measured_.measurements.push_back(*m);
      };
  ExtractionOptions extraction = options_.extraction;
  extraction.sampler.max_time_s = max_time_s;
  report.extraction =
      extractPatches(frame, *matched_, extraction, sites, std::move(report.extraction));
  // In whatever order the threads came to an end with them.
  std::sort(measured_.measurements.begin(),
            measured_.measurements.end(),
            [](const Measurement& a, const Measurement& b) { return a.id < b.id; });
  report.measurements = static_cast<int>(measured_.measurements.size());
}

FrameReport
FrameMapper::addFrom(const RangeCloud& frame, FrameReport former)
{
  FrameReport report = withMemoryOf(std::move(former));
  measure(frame, map_.pose(), options_.extraction.sampler.max_time_s, report);
  report.update = map_.update(measured_.measurements, measured_.seen_through);
  return report;
}

FrameReport
FrameMapper::add(const RangeCloud& frame, const Motion& motion, FrameReport former)
{
  map_.move(motion.increment, motion.covariance);
  return addFrom(frame, std::move(former));
}

FrameReport
FrameMapper::addStill(const RangeCloud& frame, FrameReport former)
{
  return addFrom(frame, std::move(former));
}

FrameReport
FrameMapper::addUnknown(const RangeCloud& frame, FrameReport former)
{
  if (map_.patches().empty())
    return addFrom(frame, std::move(former));
  const auto start = Clock::now();
  FrameReport report = withMemoryOf(std::move(former));
  const double limit = options_.extraction.sampler.max_time_s;
  const Pose guess = map_.pose() * power(step_, 1 + frames_missed_);
  measure(frame, guess, limit, report);
  RegistrationResult result = registered(guess);
  if (isFound(result) && isFarOff(guess, result.pose))
    if (const auto left = timeLeft(limit, start)) {
      measure(frame, result.pose, *left, report);
      result = registered(result.pose);
    }
  if (isFound(result)) {
    moveTo(result);
    report.update = map_.update(measured_.measurements, measured_.seen_through);
  }
  else {
    ++frames_missed_;
  }
  report.registration = std::move(result);
  return report;
}

RegistrationResult
FrameMapper::registered(const Pose& guess) const
{
  const auto from = [this](const Pose& pose) {
    return registerPatches(measured_.measurements, map_, pose, options_.registration);
  };
  RegistrationResult result = from(guess);
  // Who has stopped is where he was.
  if (!isFound(result))
    if (RegistrationResult still = from(map_.pose()); isFound(still))
      result = std::move(still);
  return result;
}

/// True where supports were not those of the patches that asked for them: as far off as
/// the model's error is known to describe, or further.
bool
FrameMapper::isFarOff(const Pose& guess, const Pose& found) const
{
  constexpr double kNear = 0.2; // of the radius
  const double most = kNear * options_.map.radius_m;
  return std::any_of(measured_.measurements.begin(),
                     measured_.measurements.end(),
                     [&](const Measurement& m) {
                       const Eigen::Vector3d& c = m.anchor.c;
                       return (guess.toWorld(c) - found.toWorld(c)).norm() > most;
                     });
}

void
FrameMapper::moveTo(const RegistrationResult& result)
{
  const Pose before = map_.pose();
  // To the axes of the frame before, which increments are in.
  JetMatrix T = JetMatrix::Identity();
  T.bottomRightCorner<3, 3>() = before.R.transpose();
  const Pose increment = before.inverse() * result.pose;
  map_.move(increment,
            T * poseCovariance(result, priorCovariance(options_)) * T.transpose());
  step_ = power(increment, 1.0 / (1 + frames_missed_));
  frames_missed_ = 0;
}

PatchMap
mapOfCloud(const RangeCloud& cloud,
           const Sensor& sensor,
           const MappingOptions& options,
           ExtractionResult* extraction)
{
  if (const std::string error = validityError(cloud); !error.empty())
    throw std::invalid_argument(error);
  PatchMap::Snapshot empty;
  empty.options = options.map;
  empty.pose = cloud.sensor_pose; // the frame of the map is that of the cloud
  ExtractionResult unwanted;
  ExtractionResult& result = extraction ? *extraction : unwanted;
  if (cloud.points->height < 2)
    return mapOfPoints(cloud, sensor, options, PatchMap(empty), result);
  FrameMapper mapper(sensor, options, PatchMap(empty));
  result = mapper.addStill(cloud).extraction;
  return mapper.map();
}

} // namespace holdfast
