/// \file Clouds of a camera that moves.
#pragma once

#include "arguments.h"
#include "truth_json.h"

namespace holdfast::app {

/// Writes the folder: a cloud per frame in the camera's frame, the poses, what was
/// true, and odometry where it is asked for.
void simulateFrames(const SimulateArguments& arguments, const SimulatedView& view);

} // namespace holdfast::app
