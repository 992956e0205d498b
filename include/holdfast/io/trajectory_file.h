/// \file Poses over time, from and to files in the format of the TUM RGB-D benchmark.
#pragma once

#include <holdfast/geometry/pose.h>

#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// Where a sensor was at a moment.
struct StampedPose {
  double stamp_s = 0.0;
  Pose pose; ///< q_world = R q_sensor + c, m
};

/// Reads lines `t tx ty tz qx qy qz qw`: seconds, metres and a unit quaternion, of the
/// sensor in the world, separated by blanks. Lines that are empty or begin with '#' are
/// passed over. The path "-" is standard input.
///
/// A quaternion whose norm is within 1e-3 of 1 is normalised, as it was rounded.
/// \throw std::runtime_error "FILE: line N: cause" when a line has another number of
/// columns, numbers that are none or not finite, another quaternion, or a stamp that is
/// not later than the one before; "FILE: cause" when it is missing, empty, without a
/// pose or no text.
std::vector<StampedPose> readTrajectory(const std::string& path);

/// Writes that, with the fewest digits that give every number back bit for bit.
/// Rotations come back within rounding.
/// \throw std::runtime_error when the file cannot be written; then there is none, or
/// the one from before.
/// \throw std::invalid_argument when there is no pose, or one that readTrajectory()
/// would refuse.
void writeTrajectory(const std::string& path, const std::vector<StampedPose>& poses);

/// One line about the steps from pose to pose that are more than 20 times as large as
/// the median and more than 0.5 m or 0.5 rad: a tracker that got lost, or two files in
/// one. Empty: none.
std::string doubtAbout(const std::vector<StampedPose>& poses);

/// The pose at a time, between its neighbours: the position linearly, the rotation at
/// constant speed about one axis, the shorter way. Nothing before the first and after
/// the last stamp, nor between two that are further apart than max_gap_s; at a stamp,
/// its pose.
/// \param trajectory in the order of time, as readTrajectory() gives it.
/// \throw std::invalid_argument unless max_gap_s >= 0.
std::optional<Pose> poseAt(const std::vector<StampedPose>& trajectory,
                           double stamp_s,
                           double max_gap_s);

} // namespace holdfast
