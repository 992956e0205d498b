#include "other_poses.h"

#include <holdfast/pcl/conversions.h>
#include <holdfast/sensor/names.h>
#include <holdfast/sensor/pattern_calibration.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace holdfast::app {
namespace {

constexpr int kStep = 8; // px between the pixels compared

int
widthOf(const RecordedCloud& recording)
{
  return static_cast<int>(recording.cloud.points->width);
}

int
heightOf(const RecordedCloud& recording)
{
  return static_cast<int>(recording.cloud.points->height);
}

/// 1/z of the plane along the ray of a pixel, camera frame, 1/m.
double
inverseDepth(const RecordedCloud& recording, const Eigen::Vector3d& ray)
{
  const RecordedPlane& plane = recording.plane;
  const Pose& pose = recording.cloud.sensor_pose;
  return plane.normal.dot(pose.R * ray) / (plane.offset_m - plane.normal.dot(pose.c));
}

bool
isSamePose(const RecordedCloud& a, const RecordedCloud& b)
{
  if (widthOf(a) != widthOf(b) || heightOf(a) != heightOf(b))
    return false;
  bool overlap = false;
  for (int v = 0; v < heightOf(a); v += kStep)
    for (int u = 0; u < widthOf(a); u += kStep) {
      const auto i = static_cast<std::size_t>(v * widthOf(a) + u);
      if (!a.plane.inside[i] || !b.plane.inside[i])
        continue;
      overlap = true;
      const Eigen::Vector3d ray = a.sensor.camera.backProject(u, v, 1.0);
      const double at = inverseDepth(a, ray);
      const double sigma =
          std::sqrt(a.sensor.noise->covariance(ray / at)(2, 2)) * at * at;
      if (std::abs(inverseDepth(b, ray) - at) > sigma)
        return false;
    }
  return overlap;
}

/// From the recordings of all poses but one.
NoisePattern
patternWithout(int pose,
               const std::vector<int>& poses,
               const std::vector<RecordedCloud>& recordings)
{
  std::vector<PoseFrames> frames;
  for (int other = 0; other <= *std::max_element(poses.begin(), poses.end()); ++other) {
    if (other == pose)
      continue;
    PoseFrames& of_other = frames.emplace_back();
    for (std::size_t i = 0; i < recordings.size(); ++i)
      if (poses[i] == other)
        of_other.push_back(toPointImage(recordings[i].cloud));
  }
  const Sensor& sensor = recordings.front().sensor;
  NoiseCalibrationOptions options;
  options.camera = sensor.camera;
  options.baseline_m = sensor.baseline_m;
  options.focal_px = sensor.disparity_focal_px;
  const PatternCalibration found = calibratePattern(frames, options);
  const auto name = [&] {
    const auto first = std::find(poses.begin(), poses.end(), pose) - poses.begin();
    return recordings[static_cast<std::size_t>(first)].name;
  };
  if (found.status != NoiseCalibrationStatus::Ok)
    throw std::runtime_error(name() + ": the other poses have no flat surface that "
                                      "rested, to estimate the pattern from");
  return found.pattern();
}

void
requireOneSize(const std::vector<RecordedCloud>& recordings)
{
  for (const RecordedCloud& recording : recordings)
    if (widthOf(recording) != widthOf(recordings.front()) ||
        heightOf(recording) != heightOf(recordings.front()))
      throw std::runtime_error(recording.name + ": not of the size of " +
                               recordings.front().name +
                               ", so that no pattern is common to both");
}

} // namespace

std::vector<int>
posesOf(const std::vector<RecordedCloud>& recordings)
{
  std::vector<int> poses;
  int count = 0;
  for (const RecordedCloud& recording : recordings) {
    int pose = count;
    for (std::size_t i = 0; i < poses.size() && pose == count; ++i)
      if (isSamePose(recordings[i], recording))
        pose = poses[i];
    count = std::max(count, pose + 1);
    poses.push_back(pose);
  }
  return poses;
}

void
usePatternsOfOtherPoses(std::vector<RecordedCloud>& recordings,
                        std::vector<std::string>& remarks)
{
  requireOneSize(recordings);
  const std::vector<int> poses = posesOf(recordings);
  const int count = *std::max_element(poses.begin(), poses.end()) + 1;
  if (count < 2)
    throw std::runtime_error(recordings.front().name +
                             ": no recording of another pose to estimate the pattern "
                             "from");
  std::vector<NoisePattern> patterns;
  for (int pose = 0; pose < count; ++pose)
    patterns.push_back(patternWithout(pose, poses, recordings));
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    recordings[i].sensor.pattern = patterns[static_cast<std::size_t>(poses[i])];
    remarks.push_back(fmt::format("{}: pose {} of {}, pattern of the others {}",
                                  recordings[i].name,
                                  poses[i] + 1,
                                  count,
                                  patternText(recordings[i].sensor.pattern)));
  }
}

std::string
patternText(const NoisePattern& pattern)
{
  std::string text;
  for (const PatternWave& wave : pattern.waves)
    text += fmt::format("{}{:.3f} px {} over {:.3g} px",
                        text.empty() ? "" : ", ",
                        wave.sigma,
                        kPatternShapeNames.of(wave.shape),
                        wave.length_px);
  return text.empty() ? "none" : text;
}

} // namespace holdfast::app
