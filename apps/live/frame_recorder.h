/// \file Frames as files.
#pragma once

#include <holdfast/io/range_frame.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace holdfast::app {

/// "frame_000017".
std::string frameName(std::uint64_t number);

/// Makes a folder for frames. \throw std::runtime_error "FOLDER: cause" when it cannot
/// be made, or holds frames already, which the new ones would mix with.
void makeFrameFolder(const std::string& folder);

/// Writes frames as FOLDER/frame_000001.pcd and so on, each whole or not at all, on a
/// thread of its own. When the disk is slower than the camera, frames are dropped and
/// counted, their numbers left out, or waited for where they can wait.
class FrameRecorder {
public:
  /// \throw std::runtime_error as makeFrameFolder().
  FrameRecorder(std::string folder, bool frames_can_wait);
  ~FrameRecorder();
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;

  /// \throw std::runtime_error when an earlier frame could not be written.
  void push(const RangeFrame::ConstPtr& frame);

  /// Waits until all is written. \throw std::runtime_error as push().
  void finish();

  std::uint64_t dropped() const;

private:
  void write();
  void throwError() const;

  const std::string folder_;
  const bool frames_can_wait_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<std::uint64_t, RangeFrame::ConstPtr>> waiting_; ///< by number
  bool over_ = false;
  std::uint64_t pushed_ = 0;
  std::uint64_t dropped_ = 0;
  std::string error_;
  std::thread thread_; ///< the last, so that it finds everything else in place
};

} // namespace holdfast::app
