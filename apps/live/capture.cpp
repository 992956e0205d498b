#include "capture.h"

#include <atomic>
#include <stdexcept>
#include <string>

namespace holdfast::app {

std::vector<RangeCloud>
captureFrames(const Openni2Options& options, int frames, bool quiet, Camera& camera)
{
  Openni2Options depth_only = options;
  depth_only.color = false;
  depth_only.reconnect = false;
  depth_only.playback = Playback::EveryFrame;
  Openni2Grabber grabber(depth_only);
  camera = grabber.camera();
  std::vector<RangeCloud> clouds;
  std::atomic<int> captured{0};
  RunOptions run;
  run.frames = frames;
  run.quiet = quiet;
  run.reconnects = false;
  RunCallbacks callbacks;
  callbacks.frame = [&](const RangeFrame::ConstPtr& frame) {
    clouds.push_back(frame->cloud);
    ++captured;
  };
  callbacks.status = [&] {
    return std::to_string(captured) + " of " + std::to_string(frames) + " frames";
  };
  if (runGrabber(grabber, run, callbacks) != 0 || clouds.empty())
    throw std::runtime_error("the camera did not deliver what was asked for");
  return clouds;
}

} // namespace holdfast::app
