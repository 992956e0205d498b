#include "map_stills.h"

#include "other_poses.h"
#include "spots.h"

#include "console.h"

#include <holdfast/pcl/frame_mapping.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace holdfast::app {
namespace {

constexpr double kLeastInside = 0.98; // of a disc's pixels

/// The frames of one pose and their plane p . q = 1, camera frame, p in 1/m.
struct Stills {
  std::vector<const RecordedCloud*> frames;
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
};

Eigen::Vector3d
planeOf(const RecordedCloud& recording)
{
  const Pose& pose = recording.cloud.sensor_pose;
  const Eigen::Vector3d normal = pose.R.transpose() * recording.plane.normal;
  return normal / (recording.plane.offset_m - recording.plane.normal.dot(pose.c));
}

/// Of the poses that have several frames.
std::vector<Stills>
stillsAmong(const std::vector<RecordedCloud>& recordings)
{
  const std::vector<int> poses = posesOf(recordings);
  std::vector<Stills> all(
      static_cast<std::size_t>(*std::max_element(poses.begin(), poses.end())) + 1);
  for (std::size_t i = 0; i < recordings.size(); ++i)
    all[static_cast<std::size_t>(poses[i])].frames.push_back(&recordings[i]);
  all.erase(
      std::remove_if(all.begin(),
                     all.end(),
                     [](const Stills& stills) { return stills.frames.size() < 2; }),
      all.end());
  if (all.empty())
    throw std::runtime_error(
        recordings.front().name +
        ": no two recordings of one pose, to map what stood still");
  for (Stills& stills : all)
    for (const RecordedCloud* frame : stills.frames)
      stills.plane += planeOf(*frame) / static_cast<double>(stills.frames.size());
  return all;
}

/// Whether the disc of a patch is on the plane of a frame.
bool
isOnPlane(const MapPatch& patch, const RecordedCloud& frame)
{
  const Camera& camera = frame.sensor.camera;
  const double radius = patch.radius_m;
  const auto reach =
      static_cast<int>(std::ceil(radius * camera.fx / patch.anchor.c.z()));
  const Eigen::Vector2d middle = camera.project(patch.anchor.c);
  const Eigen::Vector3d n = patch.anchor.R.col(2);
  int all = 0, inside = 0;
  for (int v = static_cast<int>(middle.y()) - reach; v <= middle.y() + reach; ++v)
    for (int u = static_cast<int>(middle.x()) - reach; u <= middle.x() + reach; ++u) {
      const Eigen::Vector3d ray = camera.backProject(u, v, 1.0);
      const double depth = n.dot(patch.anchor.c) / n.dot(ray);
      if (!((depth * ray - patch.anchor.c).norm() <= radius))
        continue;
      ++all;
      if (u >= 0 && v >= 0 && u < camera.width && v < camera.height &&
          frame.plane.inside[static_cast<std::size_t>(v * camera.width + u)])
        ++inside;
    }
  return all > 0 && inside >= kLeastInside * all;
}

/// The jet of the plane at an anchor in the frame of the camera.
JetVector
jetOf(const Eigen::Vector3d& plane, const Pose& anchor)
{
  const Eigen::Vector3d p = anchor.R.transpose() * plane;
  JetVector jet = JetVector::Zero();
  jet[0] = (1.0 - plane.dot(anchor.c)) / p.z();
  jet.segment<2>(1) = -p.head<2>() / p.z();
  return jet;
}

MapPatchError
errorOf(const MapPatch& patch, const Eigen::Vector3d& plane, double first_sigma_m)
{
  const JetMatrix P = patch.jet.covariance();
  const JetVector e = patch.jet.value() - jetOf(plane, patch.anchor);
  MapPatchError error;
  error.views = patch.views;
  error.height_sigma_m = std::sqrt(P(0, 0));
  error.first_height_sigma_m = first_sigma_m;
  error.slope_sigma = std::sqrt(std::max(P(1, 1), P(2, 2)));
  error.residual_m = 0.0;
  const auto part = [&](int first, int count) {
    return squaredInSigmas(e.segment(first, count),
                           P.block(first, first, count, count));
  };
  error.height = part(0, 1);
  error.normal = part(1, 2);
  error.curvature = part(3, 3);
  error.all = part(0, 6);
  return error;
}

StillOutcome
mapOf(const Stills& stills, const StillRule& rule, int threads)
{
  Sensor sensor = stills.frames.front()->sensor;
  if (!rule.pattern)
    sensor = withoutPattern(sensor);
  ExtractionOptions extraction;
  extraction.threads = threads;
  FrameMapper mapper(sensor, mappingOptionsFor(sensor, extraction));
  StillOutcome outcome;
  outcome.scene = fmt::format("{} and {} more",
                              stills.frames.front()->name,
                              stills.frames.size() - 1);
  const std::size_t count = rule.only_first ? 1 : stills.frames.size();
  std::map<std::uint64_t, double> first_sigmas;
  for (std::size_t k = 0; k < count; ++k) {
    const Stopwatch watch;
    const FrameReport report = mapper.addStill(stills.frames[k]->cloud);
    WalkFrame frame;
    frame.milliseconds = watch.milliseconds();
    frame.update = report.update;
    outcome.map.frames.push_back(frame);
    for (const MapPatch& patch : mapper.map().patches())
      if (patch.views == 1)
        first_sigmas[patch.id] = std::sqrt(patch.jet.covariance()(0, 0));
  }
  for (const MapPatch& patch : mapper.map().patches()) {
    const auto last = static_cast<std::size_t>(patch.last_seen - 1);
    if (isOnPlane(patch, *stills.frames[last]))
      outcome.map.patches.push_back(
          errorOf(patch, stills.plane, first_sigmas.at(patch.id)));
  }
  return outcome;
}

} // namespace

std::vector<std::vector<StillOutcome>>
mapStills(const RecordingOptions& options,
          const std::vector<StillRule>& rules,
          int threads,
          std::uint64_t seed,
          std::vector<std::string>& remarks)
{
  std::vector<RecordedCloud> recordings = loadRecordings(options, seed, remarks);
  usePatternsOfOtherPoses(recordings, remarks);
  const std::vector<Stills> all = stillsAmong(recordings);
  std::vector<std::vector<StillOutcome>> outcomes;
  for (const StillRule& rule : rules) {
    outcomes.emplace_back();
    for (const Stills& stills : all)
      outcomes.back().push_back(mapOf(stills, rule, threads));
  }
  return outcomes;
}

} // namespace holdfast::app
