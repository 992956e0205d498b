/// \file What --record writes.
#pragma once

#include "frame_recorder.h"

#include <holdfast/io/openni2_grabber.h>

#include <memory>
#include <string>

namespace holdfast::app {

/// Whether a recording of this name is an .oni file.
bool isOniPath(const std::string& path);

/// A recording of a camera: an .oni file, which the grabber writes itself and which
/// holds all it delivers, or a folder with a PCD for every frame.
class Recording {
public:
  /// \throw std::exception in one line when it cannot be begun.
  Recording(Openni2Grabber& grabber, const std::string& path, Playback playback);

  /// To be called for every frame. \throw std::runtime_error when the disk is full.
  void push(const RangeFrame::ConstPtr& frame);

  /// To be called now and then: the recorder of OpenNI2 does not notice a full disk.
  /// \throw std::runtime_error when there is no room left.
  void checkDisk() const;

  /// \throw std::exception in one line when it is not complete.
  void finish();

  /// Frames that came too fast for the disk.
  std::uint64_t dropped() const;

private:
  Openni2Grabber& grabber_;
  const std::string path_;
  std::unique_ptr<FrameRecorder> folder_; ///< null: an .oni file
};

} // namespace holdfast::app
