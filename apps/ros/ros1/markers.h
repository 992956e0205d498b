/// \file Patches as rviz shows them.
#pragma once

#include "core/session.h"

#include <visualization_msgs/MarkerArray.h>

#include <vector>

namespace holdfast::robot {

struct MarkerOptions {
  double sigmas = 3.0; ///< of the ellipsoids
  double scale = 1.0; ///< enlarges ellipsoids that would be too small to see
};

/// The outline of a patch on its surface, counter-clockwise about the normal.
std::vector<Eigen::Vector3d> outlineOnSurface(const Patch& patch);

/// In place of all markers before: the patches as one mesh (namespace "patches"),
/// coloured by surface, those of a map that the frame did not see paler; and the
/// covariances of their centres ("ellipsoids").
visualization_msgs::MarkerArray toMarkers(const Answer& answer,
                                          const MarkerOptions& options);

} // namespace holdfast::robot
