#include "pixel_disc.h"

#include <cmath>

namespace holdfast {

namespace {

PixelRange
clippedRange(int centre, double half_width, int size)
{
  const int half = static_cast<int>(std::min(half_width, static_cast<double>(size)));
  return {std::max(centre - half, 0), std::min(centre + half + 1, size)};
}

} // namespace

void
connectedDisc(const PixelGrid& grid,
              int seed,
              double radius_m,
              const JumpLimit& limit,
              RunMemory& runs,
              std::vector<int>& indices)
{
  const Camera& camera = grid.camera;
  const int u0 = seed % camera.width;
  const int v0 = seed / camera.width;
  const double slope = radius_m / grid.depth[static_cast<std::size_t>(seed)];
  const double column_radius = slope * camera.fx;
  const double row_radius = slope * camera.fy;
  PixelRuns connected(grid.rows(),
                      {limit.along(1.0 / camera.fx), limit.along(1.0 / camera.fy)},
                      runs);
  const PixelRange rows = clippedRange(v0, row_radius, camera.height);
  for (int v = rows.begin; v < rows.end; ++v) {
    const double h = (v - v0) / row_radius;
    const double half_chord = column_radius * std::sqrt(std::max(0.0, 1.0 - h * h));
    connected.addRow(v, clippedRange(u0, half_chord, camera.width));
  }
  connected.component(u0, v0, camera.width, indices);
}

} // namespace holdfast
