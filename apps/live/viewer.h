/// \file A window that shows frames and their patches.
///
/// The window itself (viewer/) is a module that is loaded when it is wanted: VTK would
/// slow the start of every command, and need not be there at all.
#pragma once

#include <holdfast/io/range_frame.h>
#include <holdfast/patch/patch.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace holdfast::app {

struct ShownPatch {
  Patch patch;
  Eigen::Matrix3d centre_covariance = Eigen::Matrix3d::Zero(); ///< m^2
  std::array<std::uint8_t, 3> color{}; ///< red green blue
  std::string caption; ///< some lines about it
  int seed = 0; ///< the same patch has the same one in the next frame
};

/// All calls from the thread that opened it.
class Viewer {
public:
  virtual ~Viewer() = default;

  virtual void show(const RangeFrame& frame,
                    const std::vector<ShownPatch>& patches) = 0;

  /// Draws, and listens to mouse and keys. \return false when the window was closed.
  virtual bool update() = 0;
};

/// \param note a line at the bottom of the window.
/// \throw std::runtime_error in one line: built without, or no display.
std::unique_ptr<Viewer> openViewer(const std::string& note);

} // namespace holdfast::app

/// What the module exports; as openViewer(). The caller owns the result.
extern "C" holdfast::app::Viewer* holdfastOpenViewer(const std::string& note);
