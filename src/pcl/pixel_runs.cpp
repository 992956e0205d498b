#include "pixel_runs.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace holdfast {

int
PixelRuns::rootOf(int i)
{
  while (runs_[i].parent != i)
    i = runs_[i].parent = runs_[runs_[i].parent].parent;
  return i;
}

/// Whether some pixel of both runs, one above the other, continues the surface.
bool
PixelRuns::touch(const Run& a, const Run& b) const
{
  const float *row_a = values_.row(a.row), *row_b = values_.row(b.row);
  const int end = std::min(a.end, b.end);
  for (int u = std::max(a.begin, b.begin); u < end; ++u)
    if (std::abs(row_a[u] - row_b[u]) < jump_.across_rows)
      return true;
  return false;
}

/// Joins the runs [above, here) of one row with those after them, of the next; both
/// lists ascend.
void
PixelRuns::joinRows(int above, int here)
{
  const int end = static_cast<int>(runs_.size());
  int a = above;
  int b = here;
  while (a < here && b < end) {
    if (touch(runs_[a], runs_[b]))
      runs_[rootOf(b)].parent = rootOf(a);
    if (runs_[a].end < runs_[b].end)
      ++a;
    else
      ++b;
  }
}

namespace {

/// Whether a pixel goes on where the one before is; none does after the last. Without
/// branches, so that several pixels are looked at at once; comparisons with NaN are
/// false: an invalid pixel ends a run. \return true when all go on.
bool
compareNeighbors(const float* __restrict value,
                 int width,
                 float jump,
                 char* __restrict continues)
{
  char all = 1;
  for (int i = 1; i < width; ++i) {
    const char goes_on = std::abs(value[i] - value[i - 1]) < jump ? 1 : 0;
    continues[i] = goes_on;
    all = static_cast<char>(all & goes_on);
  }
  continues[width] = 0;
  return all != 0;
}

} // namespace

void
PixelRuns::addRow(int row, PixelRange columns)
{
  const float* value = values_.row(row);
  const int here = static_cast<int>(runs_.size());
  const int width = std::max(columns.end - columns.begin, 0);
  continues_.resize(static_cast<std::size_t>(width) + 1);
  char* const continues = continues_.data();
  const float* const first = value + columns.begin;
  const bool is_one = compareNeighbors(first, width, jump_.in_row, continues);
  for (int begin = 0; begin < width;) {
    if (std::isnan(first[begin])) { // it goes on nowhere, and is no run
      ++begin;
      continue;
    }
    int end = width;
    if (!is_one) {
      const auto left = static_cast<std::size_t>(width - begin);
      const void* const stop = std::memchr(continues + begin + 1, 0, left);
      end = static_cast<int>(static_cast<const char*>(stop) - continues);
    }
    runs_.push_back({row,
                     columns.begin + begin,
                     columns.begin + end,
                     static_cast<int>(runs_.size())});
    begin = end;
  }
  joinRows(above_, here);
  above_ = here;
}

void
PixelRuns::component(int u, int v, int image_width, std::vector<int>& indices)
{
  indices.clear();
  const auto seed = std::find_if(runs_.begin(), runs_.end(), [&](const Run& run) {
    return run.row == v && u >= run.begin && u < run.end;
  });
  if (seed == runs_.end())
    return;
  const int root = rootOf(static_cast<int>(seed - runs_.begin()));
  for (int i = 0; i < static_cast<int>(runs_.size()); ++i) {
    if (rootOf(i) != root)
      continue;
    const std::size_t size = indices.size();
    indices.resize(size + static_cast<std::size_t>(runs_[i].end - runs_[i].begin));
    int index = runs_[i].row * image_width + runs_[i].begin;
    for (std::size_t j = size; j < indices.size(); ++j)
      indices[j] = index++;
  }
}

} // namespace holdfast
