/// \file What is stepped on: a map, or the map of a single frame.
#pragma once

#include "risk/risk_settings.h"

#include <holdfast/contact/foot.h>
#include <holdfast/fusion/patch_map.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/point_accounting.h>

#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

struct Ground {
  PatchMap map;
  bool is_map_file = false; ///< else a cloud
  std::optional<CloudFileInfo> file; ///< how the cloud was read
  /// Of the map's frame in that of the file (RangeCloud::offset).
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  /// Down in the image, where the frame is that of a camera and of nothing else.
  std::optional<Eigen::Vector3d> image_down;
  PointAccounting points; ///< of the cloud
  bool viewpoint_is_credible = true;
  double radius_m = 0.0; ///< of the patches
  std::vector<std::string> notices;
};

/// \param threads for the patches of a cloud
/// \throw std::runtime_error "FILE: cause".
Ground loadGround(const RiskSettings& settings, const Foot& foot);

/// Down, as far as the frame tells.
Eigen::Vector3d defaultLoadDirection(const Ground& ground);

} // namespace holdfast::app
