/// \file The patches of a map that are as good as planes, for planners that step on
/// convex regions.
///
/// One to one a convex_plane_decomposition_msgs/PlanarRegion: `pose` is its
/// plane_parameters, `bounds` its bbox2d {min_x, min_y, max_x, max_y}, `boundary` its
/// boundary (outer_boundary and holes), `insets` its insets. Points are in the plane of
/// the pose, m. With a RiskGrid as its gridmap they make a PlanarTerrain.
#pragma once

#include <holdfast/fusion/patch_map.h>

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace holdfast {

/// Counter-clockwise, the first point not repeated.
using PlanarOutline = std::vector<Eigen::Vector2d>;

struct OutlineWithHoles {
  PlanarOutline outer;
  std::vector<PlanarOutline> holes; ///< none: the outline keeps clear of them
};

struct PlanarRegionOptions {
  /// How far the surface may bend away from the plane at its radius: |k| r^2/2, m.
  double max_sagitta_m = 0.003;
  /// Standard deviations of the bounds that the insets keep clear of the outline.
  double inset_sigmas = 2.0;
  int corners = 24; ///< of an outline
};

/// Empty when the options make sense, else one sentence.
std::string validityError(const PlanarRegionOptions& options);

struct PlanarRegion {
  std::uint64_t patch = 0; ///< id in the map
  Pose pose; ///< frame of the map; z is the normal, out of the surface
  Eigen::Vector2d low = Eigen::Vector2d::Zero(); ///< of the boundary's bounding box
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
  /// The largest ellipse of the shape of the patch that was seen all over: convex.
  OutlineWithHoles boundary;
  /// The same by inset_sigmas of its half-axes smaller; none where nothing is left.
  std::vector<OutlineWithHoles> insets;
};

/// In the order of the patches' ids.
/// \throw std::invalid_argument when the options make no sense.
std::vector<PlanarRegion> planarRegions(const PatchMap& map,
                                        const PlanarRegionOptions& options = {});

} // namespace holdfast
