/// \file Frames and patches in a window.
#pragma once

#include "viewer.h"

#include <holdfast/pcl/patch_extraction.h>

#include <mutex>
#include <vector>

namespace holdfast::app {

/// Hands the newest frame from the grabber's thread to the window's.
class PatchView {
public:
  /// \throw std::runtime_error when there is no window.
  PatchView();

  void put(const RangeFrame::ConstPtr& frame,
           const std::vector<ExtractedPatch>& patches);

  /// On the thread that made it. \return false when the window was closed.
  bool update();

private:
  std::unique_ptr<Viewer> window_;
  std::mutex mutex_;
  RangeFrame::ConstPtr frame_; ///< null: nothing new
  std::vector<ShownPatch> patches_;
};

} // namespace holdfast::app
