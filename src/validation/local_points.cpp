#include "local_points.h"

#include "patch_form.h"

#include "fit/surface_fit.h"
#include "parallel/thread_memory.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace holdfast {

LocalPoints::LocalPoints(const Patch& patch, const PointBatch& points)
{
  place(patch, points);
}

LocalPoints::LocalPoints(const Patch& patch, const std::vector<Eigen::Vector3d>& points)
{
  auto& batch = threadMemory<PointBatch, struct PlacedPoints>();
  batch.clear(patch.c);
  batch.resize(static_cast<int>(points.size()));
  for (int c = PointBatch::SXX; c <= PointBatch::SZZ; ++c)
    std::fill_n(batch.channel(static_cast<PointBatch::Channel>(c)), points.size(), 0.0);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k)
      batch.channel(static_cast<PointBatch::Channel>(k))[i] = points[i][k] - patch.c[k];
  batch.pad();
  place(patch, batch);
}

void
LocalPoints::place(const Patch& patch, const PointBatch& points)
{
  // Kept between patches: no allocation once they have seen the largest.
  auto& memory = threadMemory<std::vector<double>, struct PlacedRows>();
  const auto rows = static_cast<std::size_t>(points.paddedSize());
  if (memory.size() < 6 * rows)
    memory.resize(6 * rows);
  double* const row = memory.data();
  placed_ = {{row, row + rows, row + 2 * rows},
             row + 3 * rows,
             row + 4 * rows,
             row + 5 * rows};
  size_ = points.size();
  // The origins are subtracted first, so that patches far from zero lose no precision.
  kernel::kernel().placePoints(
      kernelPoints(points),
      patchForm(patch, patch.pose().R, patch.c - points.origin()),
      placed_);
  leaveOutInvalid();
}

void
LocalPoints::leaveOutInvalid()
{
  double sum = 0.0;
  for (int i = 0; i < size_; ++i)
    sum += placed_.squared_distance[i];
  if (std::isfinite(sum))
    return;
  int kept = 0;
  for (int i = 0; i < size_; ++i) {
    if (!(*this)[i].allFinite())
      continue;
    for (double* row : placed_.q)
      row[kept] = row[i];
    placed_.reach[kept] = placed_.reach[i];
    placed_.squared_distance[kept] = placed_.squared_distance[i];
    placed_.variance[kept] = placed_.variance[i];
    ++kept;
  }
  size_ = kept;
}

} // namespace holdfast
