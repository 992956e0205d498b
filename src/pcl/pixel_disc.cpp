#include "pixel_disc.h"

#include <cmath>

namespace holdfast {

namespace {

int
rootOf(std::vector<Run>& runs, int i)
{
  while (runs[i].parent != i)
    i = runs[i].parent = runs[runs[i].parent].parent;
  return i;
}

/// Whether some pixel of both runs, one above the other, continues the surface.
bool
touch(const Run& a,
      const Run& b,
      const float* depth_a,
      const float* depth_b,
      float jump)
{
  const int end = std::min(a.end, b.end);
  for (int u = std::max(a.begin, b.begin); u < end; ++u)
    if (std::abs(depth_a[u] - depth_b[u]) < jump)
      return true;
  return false;
}

/// Appends the runs of connected valid pixels within a range of one row.
void
appendRuns(const float* depth,
           int row,
           PixelRange range,
           float jump,
           std::vector<Run>& runs)
{
  int u = range.begin;
  while (u < range.end) {
    const int begin = u++;
    // Comparisons with NaN are false: an invalid pixel ends a run.
    while (u < range.end && std::abs(depth[u] - depth[u - 1]) < jump)
      ++u;
    if (!std::isnan(depth[begin]))
      runs.push_back({row, begin, u, static_cast<int>(runs.size())});
  }
}

/// Joins the runs [above, here) of one row with the runs [here, end) of the next; both
/// lists ascend.
void
joinRows(const PixelGrid& grid, std::vector<Run>& runs, int above, int here, float jump)
{
  const int end = static_cast<int>(runs.size());
  int a = above;
  int b = here;
  while (a < here && b < end) {
    if (touch(runs[a], runs[b], grid.row(runs[a].row), grid.row(runs[b].row), jump))
      runs[rootOf(runs, b)].parent = rootOf(runs, a);
    if (runs[a].end < runs[b].end)
      ++a;
    else
      ++b;
  }
}

int
runAt(const std::vector<Run>& runs, int row, int column)
{
  for (int i = 0; i < static_cast<int>(runs.size()); ++i)
    if (runs[i].row == row && column >= runs[i].begin && column < runs[i].end)
      return i;
  return -1;
}

/// Indices of the pixels of all runs connected to the seed's.
void
emitComponent(std::vector<Run>& runs,
              int seed_run,
              int width,
              std::vector<int>& indices)
{
  const int root = rootOf(runs, seed_run);
  for (int i = 0; i < static_cast<int>(runs.size()); ++i) {
    if (rootOf(runs, i) != root)
      continue;
    const std::size_t size = indices.size();
    indices.resize(size + static_cast<std::size_t>(runs[i].end - runs[i].begin));
    int index = runs[i].row * width + runs[i].begin;
    for (std::size_t j = size; j < indices.size(); ++j)
      indices[j] = index++;
  }
}

PixelRange
clippedRange(int centre, double half_width, int size)
{
  const int half = static_cast<int>(std::min(half_width, static_cast<double>(size)));
  return {std::max(centre - half, 0), std::min(centre + half + 1, size)};
}

} // namespace

// Connected components by runs: one pass over the pixels, one comparison each; whole
// runs are joined where rows meet.
void
connectedDisc(const PixelGrid& grid,
              int seed,
              double radius_m,
              const JumpLimit& limit,
              std::vector<Run>& runs,
              std::vector<int>& indices)
{
  const Camera& camera = grid.camera;
  const int u0 = seed % camera.width;
  const int v0 = seed / camera.width;
  const double slope = radius_m / grid.depth[static_cast<std::size_t>(seed)];
  const double column_radius = slope * camera.fx;
  const double row_radius = slope * camera.fy;
  const float column_jump = limit.along(1.0 / camera.fx);
  const float row_jump = limit.along(1.0 / camera.fy);

  runs.clear();
  int above = 0;
  const PixelRange rows = clippedRange(v0, row_radius, camera.height);
  for (int v = rows.begin; v < rows.end; ++v) {
    const double h = (v - v0) / row_radius;
    const double half_chord = column_radius * std::sqrt(std::max(0.0, 1.0 - h * h));
    const int here = static_cast<int>(runs.size());
    const PixelRange chord = clippedRange(u0, half_chord, camera.width);
    appendRuns(grid.row(v), v, chord, column_jump, runs);
    joinRows(grid, runs, above, here, row_jump);
    above = here;
  }
  indices.clear();
  emitComponent(runs, runAt(runs, v0, u0), camera.width, indices);
}

} // namespace holdfast
