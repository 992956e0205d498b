#include "map/frame_poses.h"

#include <holdfast/io/trajectory_file.h>

#include <fmt/core.h>

#include <charconv>
#include <filesystem>
#include <optional>
#include <stdexcept>

namespace holdfast::app {
namespace {

/// A frame named by its time, as those of the TUM benchmark: 1305031102.160407.png.
std::optional<double>
stampOf(const std::string& path)
{
  const std::string stem = std::filesystem::path(path).stem().string();
  double stamp = 0.0;
  const auto [end, error] =
      std::from_chars(stem.data(), stem.data() + stem.size(), stamp);
  if (error != std::errc() || end != stem.data() + stem.size())
    return std::nullopt;
  return stamp;
}

} // namespace

std::vector<Pose>
posesOf(const std::vector<std::string>& frames,
        const std::string& trajectory,
        std::vector<std::string>& notices)
{
  constexpr double kLongestGap = 0.1; // s: three frames at 30 Hz
  const std::vector<StampedPose> stamped = readTrajectory(trajectory);
  if (const std::string doubt = doubtAbout(stamped); !doubt.empty())
    notices.push_back(trajectory + ": " + doubt);
  std::vector<Pose> poses;
  if (stamped.size() == frames.size()) {
    for (const StampedPose& pose : stamped)
      poses.push_back(pose.pose);
    return poses;
  }
  for (const std::string& frame : frames) {
    const auto stamp = stampOf(frame);
    if (!stamp)
      throw std::runtime_error(fmt::format(
          "{}: {} poses for {} frames, and {} is no time stamp to tell which",
          trajectory,
          stamped.size(),
          frames.size(),
          frame));
    const auto pose = poseAt(stamped, *stamp, kLongestGap);
    if (!pose)
      throw std::runtime_error(fmt::format("{}: no pose within {} s of frame {}",
                                           trajectory,
                                           kLongestGap,
                                           frame));
    poses.push_back(*pose);
  }
  return poses;
}

} // namespace holdfast::app
