/// \file The boundary of a patch in its local xy plane.
#pragma once

#include <holdfast/patch/patch.h>

#include <array>
#include <vector>

namespace holdfast {

/// True when the local (x, y) lies within the boundary (on it, within rounding, counts
/// as within).
bool contains(const Patch& patch, const Eigen::Vector2d& local_xy);

/// Area enclosed in the local xy plane, m^2.
double projectedArea(const Patch& patch);

/// The boundary as a closed counter-clockwise curve of four sides with parameter u in
/// [0, 4): side s runs over [s, s + 1) from corner s to the next. Corner 0 lies in the
/// first quadrant for rectangles and quads; the sides of an ellipse or circle are its
/// quarters, from the positive x axis on. \return the local (x, y).
Eigen::Vector2d boundaryPoint(const Patch& patch, double u);

/// Into how many pieces outline() splits each side.
/// \throw std::invalid_argument when spacing is not a positive number, or so small that
/// a side would need over a million pieces.
std::array<int, 4> outlineSegments(const Patch& patch, double spacing);

/// A closed counter-clockwise polygon along the boundary in the local xy plane, edges
/// at most `spacing` metres long, corners of rectangles and quads exact; at least eight
/// vertices around an ellipse or circle. The first vertex is not repeated.
/// \throw std::invalid_argument as outlineSegments().
std::vector<Eigen::Vector2d> outline(const Patch& patch, double spacing);

} // namespace holdfast
