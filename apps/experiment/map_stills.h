/// \file Maps of what a camera that stood still recorded, about the plane before it.
#pragma once

#include "map_walk.h"
#include "recordings.h"

#include <cstdint>
#include <string>
#include <vector>

namespace holdfast::app {

/// What a map makes of the frames of one pose.
struct StillRule {
  std::string name;
  bool only_first; ///< frame
  bool pattern; ///< what the pixels share is told; else all errors are independent
};

struct StillOutcome {
  std::string scene; ///< the frames
  WalkOutcome map; ///< its patches are those on the plane
};

/// Takes the frames of every pose of which there are several into a map, and compares
/// its patches with the plane of those frames: the mean of the largest plane of each,
/// in inverse depth. A patch counts when all pixels of its disc, but for 2 %, were on
/// the plane when it was last seen. The pattern of a pose is that of all other poses,
/// so that nothing is tested on what it was estimated from.
/// \param remarks is told what the readers decided.
/// \throw std::runtime_error when no pose has several frames, or there is but one.
std::vector<std::vector<StillOutcome>> mapStills(const RecordingOptions& options,
                                                 const std::vector<StillRule>& rules,
                                                 int threads,
                                                 std::uint64_t seed,
                                                 std::vector<std::string>& remarks);

} // namespace holdfast::app
