/// \file A few frames of a camera.
#pragma once

#include "device_options.h"

#include <vector>

namespace holdfast::app {

/// The next frames of a camera, or fewer when a recording ends or the user interrupts,
/// with a status line unless `quiet`. `camera` receives its intrinsics.
/// \throw pcl::IOException as Openni2Grabber. \throw std::runtime_error when the camera
/// fails.
std::vector<RangeCloud> captureFrames(const Openni2Options& options,
                                      int frames,
                                      bool quiet,
                                      Camera& camera);

} // namespace holdfast::app
