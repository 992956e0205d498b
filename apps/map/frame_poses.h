/// \file Which pose belongs to which frame.
#pragma once

#include <holdfast/geometry/pose.h>

#include <string>
#include <vector>

namespace holdfast::app {

/// The pose of each frame from a trajectory file: one for one where there are as many,
/// else by the time stamps that the frames' names are.
/// \param notices receives what is odd about the poses.
/// \throw std::runtime_error "FILE: cause" when they do not go together.
std::vector<Pose> posesOf(const std::vector<std::string>& frames,
                          const std::string& trajectory,
                          std::vector<std::string>& notices);

} // namespace holdfast::app
