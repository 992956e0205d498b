#include <holdfast/io/trajectory_file.h>

#include <holdfast/geometry/rotation.h>
#include <holdfast/io/atomic_file.h>

#include "cloud_readers.h"
#include "file_bytes.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ostream>
#include <stdexcept>

#include <fmt/format.h>

namespace holdfast {
namespace {

constexpr std::array kColumns{"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
using Numbers = std::array<double, kColumns.size()>;

// Files with four digits are off by 1e-4.
constexpr double kNormTolerance = 1e-3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Numbers
parseNumbers(std::string_view line)
{
  if (line.find_first_of(",;") != std::string_view::npos)
    throw std::runtime_error(
        "has commas: columns are separated by blanks, and decimals "
        "written with a point");
  const std::vector<std::string_view> words = io::splitWords(line);
  if (words.size() != kColumns.size())
    throw std::runtime_error(fmt::format("{} column{}, not 8: t tx ty tz qx qy qz qw",
                                         words.size(),
                                         words.size() == 1 ? "" : "s"));
  Numbers numbers{};
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::optional<double> number = io::parseNumber(words[i]);
    const auto complain = [&](const char* what) {
      throw std::runtime_error(
          fmt::format("{} is {}: '{}'", kColumns[i], what, io::printable(words[i])));
    };
    if (!number)
      complain("no number");
    else if (!std::isfinite(*number))
      complain("not finite");
    else
      numbers[i] = *number;
  }
  return numbers;
}

StampedPose
parsePose(std::string_view line)
{
  const Numbers n = parseNumbers(line);
  const Eigen::Quaterniond q(n[7], n[4], n[5], n[6]);
  if (!(std::abs(q.norm() - 1.0) <= kNormTolerance))
    throw std::runtime_error(
        fmt::format("the quaternion has the norm {:.6g}, not 1", q.norm()));
  return {n[0], {q.normalized().toRotationMatrix(), {n[1], n[2], n[3]}}};
}

bool
isPassedOver(std::string_view line)
{
  const std::string_view word = io::takeWord(line);
  return word.empty() || word.front() == '#';
}

std::string_view
withoutByteOrderMark(std::string_view text)
{
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.substr(0, kMark.size()) == kMark)
    text.remove_prefix(kMark.size());
  return text;
}

std::vector<StampedPose>
parseTrajectory(std::string_view text)
{
  std::vector<StampedPose> poses;
  text = withoutByteOrderMark(text);
  const char line_end = io::lineEnd(text);
  int number = 0;
  int number_before = 0; // of the line of the last pose
  while (const auto line = io::takeLine(text, line_end)) {
    ++number;
    if (isPassedOver(*line))
      continue;
    try {
      const StampedPose pose = parsePose(*line);
      if (!poses.empty() && !(pose.stamp_s > poses.back().stamp_s))
        throw std::runtime_error(fmt::format("the stamp {} is not later than {} of "
                                             "line {}",
                                             pose.stamp_s,
                                             poses.back().stamp_s,
                                             number_before));
      poses.push_back(pose);
      number_before = number;
    }
    catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("line {}: {}", number, error.what()));
    }
  }
  if (poses.empty())
    throw std::runtime_error("has no pose");
  return poses;
}

void
requireWritable(const std::vector<StampedPose>& poses)
{
  if (poses.empty())
    throw std::invalid_argument("writeTrajectory: no pose");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto& [stamp, pose] = poses[i];
    if (!std::isfinite(stamp) || !pose.c.allFinite() || !pose.R.allFinite())
      throw std::invalid_argument(
          fmt::format("writeTrajectory: pose {} is not finite", i));
    if (i > 0 && !(stamp > poses[i - 1].stamp_s))
      throw std::invalid_argument(
          fmt::format("writeTrajectory: pose {} is not later than the one before", i));
    if (!pose.R.isUnitary(kNormTolerance))
      throw std::invalid_argument(
          fmt::format("writeTrajectory: pose {} has no rotation", i));
  }
}

/// Of one kind: how far from pose i to pose i + 1.
struct Steps {
  std::vector<double> sizes;
  const char* unit;

  double median() const
  {
    std::vector<double> sorted = sizes;
    const auto middle =
        sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
  }

  /// Indices of the steps that nobody takes.
  std::vector<std::size_t> jumps() const
  {
    constexpr double kTimes = 20.0;
    constexpr double kLeast = 0.5; // m or rad
    const double limit = std::max(kLeast, kTimes * median());
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < sizes.size(); ++i)
      if (sizes[i] > limit)
        found.push_back(i);
    return found;
  }
};

} // namespace

std::vector<StampedPose>
readTrajectory(const std::string& path)
{
  try {
    const io::FileBytes content = io::readBytes(path, "a trajectory");
    const std::string_view bytes = content.view();
    if (const auto name = io::nameOfStranger(bytes))
      throw std::runtime_error("is " + std::string(*name));
    if (bytes.find('\0') != std::string_view::npos)
      throw std::runtime_error("is binary, not a trajectory");
    return parseTrajectory(bytes);
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

void
writeTrajectory(const std::string& path, const std::vector<StampedPose>& poses)
{
  requireWritable(poses);
  AtomicFile file(path);
  file.stream() << "# t tx ty tz qx qy qz qw: s, m, the sensor in the world\n";
  for (const auto& [stamp, pose] : poses) {
    const Eigen::Quaterniond q = Eigen::Quaterniond(pose.R).normalized();
    file.stream() << fmt::format("{} {} {} {} {} {} {} {}\n",
                                 stamp,
                                 pose.c.x(),
                                 pose.c.y(),
                                 pose.c.z(),
                                 q.x(),
                                 q.y(),
                                 q.z(),
                                 q.w());
  }
  file.commit();
}

std::string
doubtAbout(const std::vector<StampedPose>& poses)
{
  if (poses.size() < 2)
    return "";
  Steps shifts{{}, "m"}, turns{{}, "rad"};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Pose step = poses[i - 1].pose.inverse() * poses[i].pose;
    // Between positions of 1e308 m nothing is a number; the median needs an order.
    const double shift = step.c.norm();
    shifts.sizes.push_back(std::isfinite(shift) ? shift : kInfinity);
    turns.sizes.push_back(logMap(step.R).norm());
  }
  for (const Steps& steps : {shifts, turns}) {
    const std::vector<std::size_t> jumps = steps.jumps();
    if (jumps.empty())
      continue;
    const std::size_t i = jumps.front();
    return fmt::format(
        "pose {} (stamp {}) is {:.3g} {} from the one before, where the "
        "median step is {:.3g} {}{}",
        i + 1,
        poses[i + 1].stamp_s,
        steps.sizes[i],
        steps.unit,
        steps.median(),
        steps.unit,
        jumps.size() > 1 ? fmt::format("; {} such jumps in all", jumps.size()) : "");
  }
  return "";
}

std::optional<Pose>
poseAt(const std::vector<StampedPose>& trajectory, double stamp_s, double max_gap_s)
{
  if (!(max_gap_s >= 0.0))
    throw std::invalid_argument("poseAt: max_gap_s must be a number >= 0");
  const auto after =
      std::lower_bound(trajectory.begin(),
                       trajectory.end(),
                       stamp_s,
                       [](const StampedPose& a, double t) { return a.stamp_s < t; });
  if (after == trajectory.end() || std::isnan(stamp_s))
    return std::nullopt;
  if (after->stamp_s == stamp_s)
    return after->pose;
  if (after == trajectory.begin())
    return std::nullopt;
  const StampedPose& a = *(after - 1);
  const StampedPose& b = *after;
  const double gap = b.stamp_s - a.stamp_s;
  if (gap > max_gap_s)
    return std::nullopt;
  const double s = (stamp_s - a.stamp_s) / gap;
  return Pose{a.pose.R * expMap(s * logMap(a.pose.R.transpose() * b.pose.R)),
              a.pose.c + s * (b.pose.c - a.pose.c)};
}

} // namespace holdfast
