/// \file Triangle mesh of a bounded patch.
#pragma once

#include <holdfast/patch/patch.h>

#include <array>
#include <vector>

namespace holdfast {

struct Mesh {
  std::vector<Eigen::Vector3d> vertices; ///< world frame, m
  std::vector<std::array<int, 3>> triangles; ///< counter-clockwise around the normal
};

/// The patch as a mesh whose outer edge is exactly the polygon outline(patch, spacing)
/// lifted to the surface, without gaps, T-junctions or unused vertices. The first
/// vertices are those of the outline, in its order. In the xy projection no edge is
/// longer than twice the spacing, those along the outline than the spacing; across
/// narrow patches they are shorter. Where a sphere's or cylinder's boundary reaches
/// beyond its equator, the mesh ends at the equator.
/// \throw std::invalid_argument as outlineSegments().
Mesh tessellate(const Patch& patch, double spacing);

} // namespace holdfast
