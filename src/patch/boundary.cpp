#include <holdfast/geometry/constants.h>
#include <holdfast/patch/boundary.h>

#include "boundary_form.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

constexpr double kMostSegments = 1e6;

// Half-axes of an ellipse, both the radius for a circle.
Eigen::Vector2d
halfAxes(const Patch& patch)
{
  if (patch.type.boundary == BoundaryType::Circle)
    return {patch.d(0), patch.d(0)};
  return patch.d.head<2>();
}

bool
hasCorners(BoundaryType boundary)
{
  return boundary == BoundaryType::Rectangle || boundary == BoundaryType::Quad;
}

// Corners of a rectangle or quad, counter-clockwise from the first quadrant.
std::array<Eigen::Vector2d, 4>
corners(const Patch& patch)
{
  if (patch.type.boundary == BoundaryType::Rectangle) {
    const double x = patch.d(0);
    const double y = patch.d(1);
    return {{{x, y}, {-x, y}, {-x, -y}, {x, -y}}};
  }
  // At distances d1..d4 along the two diagonals, directions gamma, pi - gamma,
  // pi + gamma, -gamma.
  const double x = std::cos(patch.d(4));
  const double y = std::sin(patch.d(4));
  return {{patch.d(0) * Eigen::Vector2d(x, y),
           patch.d(1) * Eigen::Vector2d(-x, y),
           patch.d(2) * Eigen::Vector2d(-x, -y),
           patch.d(3) * Eigen::Vector2d(x, -y)}};
}

double
cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b)
{
  return a.x() * b.y() - a.y() * b.x();
}

int
segmentCount(double length, double spacing)
{
  if (!(spacing > 0.0))
    throw std::invalid_argument("holdfast: the spacing must be a positive number");
  const double count = std::max(1.0, std::ceil(length / spacing));
  if (!(count <= kMostSegments))
    throw std::invalid_argument("holdfast: the spacing is too small for the patch");
  return static_cast<int>(count);
}

} // namespace

BoundaryForm::BoundaryForm(const Patch& patch)
: is_ellipse(!hasCorners(patch.type.boundary)), ax{}, ay{}
{
  if (is_ellipse) {
    const Eigen::Vector2d axes = halfAxes(patch);
    ax[0] = 1.0 / axes.x();
    ay[0] = 1.0 / axes.y();
    return;
  }
  const auto corner = corners(patch);
  for (std::size_t s = 0; s < 4; ++s) {
    const Eigen::Vector2d side = corner[(s + 1) % 4] - corner[s];
    // The centre is at this distance, times |side|, on the inner side of the edge.
    const double inside = cross(corner[s], side);
    ax[s] = side.y() / inside;
    ay[s] = -side.x() / inside;
  }
}

bool
contains(const Patch& patch, const Eigen::Vector2d& local_xy)
{
  return BoundaryForm(patch).contains(local_xy.x(), local_xy.y());
}

double
projectedArea(const Patch& patch)
{
  const auto& d = patch.d;
  switch (patch.type.boundary) {
  case BoundaryType::Rectangle:
    return 4.0 * d(0) * d(1);
  case BoundaryType::Quad:
    // Half the cross product of the diagonals, which meet at the angle 2 gamma.
    return 0.5 * (d(0) + d(2)) * (d(1) + d(3)) * std::sin(2.0 * d(4));
  case BoundaryType::Ellipse:
  case BoundaryType::Circle:
    break;
  }
  return kPi * halfAxes(patch).prod();
}

Eigen::Vector2d
boundaryPoint(const Patch& patch, double u)
{
  const double side = std::floor(u);
  const double along = u - side;
  if (hasCorners(patch.type.boundary)) {
    const auto corner = corners(patch);
    const auto s = static_cast<std::size_t>(side) % 4;
    return (1.0 - along) * corner[s] + along * corner[(s + 1) % 4];
  }
  const double angle = 0.5 * kPi * u;
  return halfAxes(patch).cwiseProduct(
      Eigen::Vector2d(std::cos(angle), std::sin(angle)));
}

std::array<int, 4>
outlineSegments(const Patch& patch, double spacing)
{
  std::array<int, 4> segments{};
  if (!hasCorners(patch.type.boundary)) {
    // Equal steps of the angle; none is longer than the larger half-axis times it.
    const double longest = 0.5 * kPi * halfAxes(patch).maxCoeff();
    segments.fill(std::max(2, segmentCount(longest, spacing)));
    return segments;
  }
  const auto corner = corners(patch);
  for (std::size_t s = 0; s < 4; ++s)
    segments[s] = segmentCount((corner[(s + 1) % 4] - corner[s]).norm(), spacing);
  return segments;
}

std::vector<Eigen::Vector2d>
outline(const Patch& patch, double spacing)
{
  const std::array<int, 4> segments = outlineSegments(patch, spacing);
  std::vector<Eigen::Vector2d> polygon;
  for (std::size_t s = 0; s < 4; ++s)
    for (int i = 0; i < segments[s]; ++i)
      polygon.push_back(
          boundaryPoint(patch, static_cast<double>(s) + double(i) / segments[s]));
  return polygon;
}

} // namespace holdfast
