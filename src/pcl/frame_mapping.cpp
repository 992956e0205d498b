#include <holdfast/pcl/frame_mapping.h>

#include <holdfast/geometry/rotation.h>
#include <holdfast/pcl/intrinsics.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

ExtractionOptions
extractionFor(const MappingOptions& options)
{
  ExtractionOptions extraction = options.extraction;
  extraction.fit.surface = SurfaceRequest::Paraboloid;
  extraction.fit.separate_pattern = true;
  extraction.sampler.radius_m = options.map.radius_m;
  return extraction;
}

bool
hasSizeOf(const RangeCloud& frame, const Camera& camera)
{
  return static_cast<int>(frame.points->width) == camera.width &&
         static_cast<int>(frame.points->height) == camera.height;
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
  extraction = extractPatches(cloud, sensor, extractionFor(options), sites);
  map.update(measurements); // in whatever order
  return map;
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

/// What a frame says.
struct FrameMapper::Measured {
  std::vector<Measurement> measurements;
  std::vector<std::uint64_t> seen_through;
};

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
  options_.extraction = extractionFor(options_);
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
  if (!matched_ || !hasSizeOf(frame, matched_->camera))
    matched_ = matchedSensor(sensor_, frame);
}

FrameMapper::Places
FrameMapper::placesIn(const RangeCloud& frame, const Pose& sensor, FrameReport& report)
{
  Places places;
  // A frame that does not tell its camera has next to no point.
  if (!hasSizeOf(frame, matched_->camera))
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

FrameMapper::Measured
FrameMapper::measure(const RangeCloud& frame, const Pose& sensor, FrameReport& report)
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
  const Places places = placesIn(frame, sensor, report);
  Measured measured;
  measured.seen_through = places.seen_through;
  PatchSites sites;
  sites.first_seeds = places.seeds;
  sites.is_free = [&](const Seed& seed) {
    return !map_.hasAnchorWithin(to_map.toWorld(seed.position), nearest);
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
        measured.measurements.push_back(*m);
      };
  report.extraction = extractPatches(frame, *matched_, options_.extraction, sites);
  // In whatever order the threads came to an end with them.
  std::sort(measured.measurements.begin(),
            measured.measurements.end(),
            [](const Measurement& a, const Measurement& b) { return a.id < b.id; });
  report.measurements = static_cast<int>(measured.measurements.size());
  return measured;
}

void
FrameMapper::update(const Measured& measured, FrameReport& report)
{
  report.update = map_.update(measured.measurements, measured.seen_through);
}

FrameReport
FrameMapper::add(const RangeCloud& frame, const Motion& motion)
{
  FrameReport report;
  map_.move(motion.increment, motion.covariance);
  update(measure(frame, map_.pose(), report), report);
  return report;
}

FrameReport
FrameMapper::addStill(const RangeCloud& frame)
{
  FrameReport report;
  update(measure(frame, map_.pose(), report), report);
  return report;
}

FrameReport
FrameMapper::addUnknown(const RangeCloud& frame)
{
  FrameReport report;
  const Pose guess = map_.pose() * power(step_, 1 + frames_missed_);
  const Measured measured = measure(frame, guess, report);
  if (map_.patches().empty() || moveByRegistration(measured, guess, report))
    update(measured, report);
  return report;
}

bool
FrameMapper::moveByRegistration(const Measured& measured,
                                const Pose& guess,
                                FrameReport& report)
{
  const Pose before = map_.pose();
  const auto registered = [&](const Pose& from) {
    return registerPatches(measured.measurements, map_, from, options_.registration);
  };
  RegistrationResult result = registered(guess);
  // Who has stopped is where he was.
  if (result.status != RegistrationStatus::Converged)
    if (RegistrationResult still = registered(before);
        still.status == RegistrationStatus::Converged)
      result = std::move(still);
  const bool is_found = result.status == RegistrationStatus::Converged;
  if (is_found) {
    // To the axes of the frame before, which increments are in.
    JetMatrix T = JetMatrix::Identity();
    T.bottomRightCorner<3, 3>() = before.R.transpose();
    const Pose increment = before.inverse() * result.pose;
    map_.move(increment,
              T * poseCovariance(result, priorCovariance(options_)) * T.transpose());
    step_ = power(increment, 1.0 / (1 + frames_missed_));
    frames_missed_ = 0;
  }
  else {
    ++frames_missed_;
  }
  report.registration = std::move(result);
  return is_found;
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
