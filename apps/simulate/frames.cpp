#include "frames.h"

#include "console.h"
#include "image_cloud.h"

#include <holdfast/io/atomic_folder.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/trajectory_file.h>
#include <holdfast/simulation/trajectory.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast::app {

namespace {

constexpr int kFrames = 30;
// At the usual step 0.5 m/s, a walking robot.
constexpr double kFramesPerSecond = 5.0;

/// The first poses of a file, as many as are asked for.
std::vector<StampedPose>
posesOf(const TrajectoryArguments& moving, bool quiet)
{
  const std::string& path = moving.trajectory;
  std::vector<StampedPose> poses = readTrajectory(path);
  if (poses.size() < 2)
    throw std::runtime_error(path + ": has one pose; a trajectory has two or more");
  if (const std::string doubt = doubtAbout(poses); !doubt.empty() && !quiet)
    printNotice(path + ": " + doubt);
  const auto frames =
      moving.frames ? static_cast<std::size_t>(*moving.frames) : poses.size();
  if (frames > poses.size())
    throw CLI::ValidationError(
        "--frames",
        fmt::format("{} has {} poses, not {}", path, poses.size(), frames));
  poses.resize(frames);
  return poses;
}

std::vector<StampedPose>
stampedPoses(const TrajectoryArguments& moving, const Scene& scene, bool quiet)
{
  if (!moving.isMadeUp())
    return posesOf(moving, quiet);
  WalkOptions options;
  options.step_m = moving.step();
  const int frames = moving.frames.value_or(kFrames);
  const std::vector<Pose> poses = moving.trajectory == "walk" ?
                                      walk(scene, frames, options) :
                                      circle(scene, frames, options.step_m);
  std::vector<StampedPose> stamped;
  for (const Pose& pose : poses)
    stamped.push_back({static_cast<double>(stamped.size()) / kFramesPerSecond, pose});
  return stamped;
}

/// What odometry would say of that way; its errors are not those of any frame.
std::vector<StampedPose>
odometryOf(const std::vector<StampedPose>& truth, const SimulateArguments& arguments)
{
  std::vector<Pose> poses;
  for (const StampedPose& stamped : truth)
    poses.push_back(stamped.pose);
  std::seed_seq words{static_cast<std::uint32_t>(arguments.random_seed),
                      static_cast<std::uint32_t>(arguments.random_seed >> 32U),
                      std::uint32_t{0},
                      std::uint32_t{1}};
  std::mt19937_64 generator(words);
  const Odometry odometry =
      noisyOdometry(poses,
                    arguments.moving.odometry_sigma_rad.value_or(0.0),
                    arguments.moving.odometry_sigma_m.value_or(0.0),
                    generator);
  std::vector<StampedPose> believed = truth;
  for (std::size_t k = 0; k < believed.size(); ++k)
    believed[k].pose = odometry.poses[k];
  return believed;
}

std::vector<std::string>
cloudNames(std::size_t frames)
{
  std::vector<std::string> names;
  for (std::size_t k = 0; k < frames; ++k)
    names.push_back(fmt::format("frame_{:04d}.pcd", k));
  return names;
}

std::size_t
pointsIn(const RangeImage& image)
{
  return static_cast<std::size_t>(
      std::count_if(image.points.begin(),
                    image.points.end(),
                    [](const Eigen::Vector3d& point) { return point.allFinite(); }));
}

/// \throw std::runtime_error when nothing is seen from there.
RangeImage
frameAt(const FrameSimulator& simulator,
        int k,
        const Pose& pose,
        const SimulatedView& view)
{
  RangeImage image = inSensorFrame(simulator.frame(k, pose));
  if (!seesAnything(image))
    throw std::runtime_error(
        fmt::format("not written: nothing of the scene {} is within the range of "
                    "sensor {} at pose {}",
                    view.scene.name,
                    view.sensor.name,
                    k));
  return image;
}

/// Writes all files into a folder. \return the number of points.
std::size_t
writeFrames(const std::string& folder,
            const SimulateArguments& arguments,
            const SimulatedView& view,
            const std::vector<StampedPose>& poses)
{
  const FrameSimulator simulator(
      view.scene,
      view.rays,
      view.sensor,
      arguments.simulation,
      arguments.moving.fresh_pattern ? PatternOverTime::Fresh : PatternOverTime::Fixed,
      arguments.random_seed);
  const std::vector<std::string> names = cloudNames(poses.size());
  const int frames = static_cast<int>(poses.size());
  ProgressBar bar("simulating", !arguments.quiet);
  std::size_t points = 0;
  for (int k = 0; k < frames; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const RangeImage image = frameAt(simulator, k, poses[i].pose, view);
    saveCloud(folder + "/" + names[i],
              cloudOf(image,
                      view.sensor,
                      arguments.simulation.noise_scale,
                      arguments.covariance),
              arguments.ascii);
    points += pointsIn(image);
    bar.update(k + 1, frames);
  }
  writeTrajectory(folder + "/trajectory.txt", poses);
  if (arguments.moving.wantsOdometry())
    writeTrajectory(folder + "/odometry.txt", odometryOf(poses, arguments));
  saveJson(folder + "/truth.json", movingTruthJson(arguments, view, names));
  return points;
}

/// m
double
lengthOf(const std::vector<StampedPose>& poses)
{
  double length = 0.0;
  for (std::size_t k = 1; k < poses.size(); ++k)
    length += (poses[k].pose.c - poses[k - 1].pose.c).norm();
  return length;
}

} // namespace

void
simulateFrames(const SimulateArguments& arguments, const SimulatedView& view)
{
  const std::vector<StampedPose> poses =
      stampedPoses(arguments.moving, view.scene, arguments.quiet);
  AtomicFolder folder(arguments.output);
  const std::string& temporary = folder.temporaryPath();
  std::size_t points = 0;
  try {
    points = writeFrames(temporary, arguments, view, poses);
  }
  catch (const std::runtime_error& error) {
    // The user knows no folder but the one asked for.
    std::string message = error.what();
    if (message.compare(0, temporary.size(), temporary) == 0)
      throw std::runtime_error(arguments.output + message.substr(temporary.size()));
    throw std::runtime_error(arguments.output + ": " + message);
  }
  folder.commit();
  if (!arguments.quiet)
    std::cout << fmt::format("{}: {} frames of {} by {}, {:.2f} m of way, {} points\n",
                             arguments.output,
                             poses.size(),
                             view.scene.name,
                             view.sensor.name,
                             lengthOf(poses),
                             points);
}

} // namespace holdfast::app
