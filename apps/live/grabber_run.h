/// \file From the start of a camera to its end.
#pragma once

#include <holdfast/io/openni2_grabber.h>
#include <holdfast/io/range_frame.h>

#include <chrono>
#include <functional>
#include <string>

namespace holdfast::app {

struct RunOptions {
  int frames = 0; ///< end after so many; 0: never
  double seconds = 0.0; ///< end after this time; 0: never
  bool quiet = false; ///< errors only
  std::chrono::milliseconds idle_period{50}; ///< between two looks at the run
  bool reconnects = true; ///< the camera's return is waited for
  bool records_oni = false; ///< a recording that ends when the camera fails
};

struct RunCallbacks {
  /// On a thread of the grabber. What it throws ends the run.
  std::function<void(const RangeFrame::ConstPtr&)> frame;
  /// A line that says how it goes, on this thread.
  std::function<std::string()> status;
  /// Once per idle_period, on this thread. False ends the run.
  std::function<bool()> idle = [] { return true; };
};

/// Runs a camera until there are enough frames, a recording has ended, the camera has
/// failed for good, or the user has had enough (SIGINT, SIGTERM, SIGHUP, at which
/// everything is put in order). What happens to the camera is told on standard error.
/// \return the exit code of the command. \throw what the callback for frames threw.
int runGrabber(Openni2Grabber& grabber,
               const RunOptions& options,
               const RunCallbacks& callbacks);

} // namespace holdfast::app
