#include "nearest_points.h"

#include <algorithm>

namespace holdfast {
namespace {

/// Halves this small are searched point by point.
constexpr std::size_t kLeaf = 12;

bool
isNearer(const PathEnd& a, const PathEnd& b)
{
  return b > a;
}

} // namespace

struct NearestPoints::Query {
  float q[3];
  std::size_t k;
  std::vector<PathEnd>& heap; ///< the furthest in front

  void offer(const Entry& entry)
  {
    float squared = 0.0F;
    for (int axis = 0; axis < 3; ++axis)
      squared += (entry.q[axis] - q[axis]) * (entry.q[axis] - q[axis]);
    const PathEnd end{squared, entry.index};
    if (heap.size() == k) {
      if (!isNearer(end, heap.front()))
        return;
      std::pop_heap(heap.begin(), heap.end(), isNearer);
      heap.pop_back();
    }
    heap.push_back(end);
    std::push_heap(heap.begin(), heap.end(), isNearer);
  }

  /// A point as far as the furthest may have the smaller index.
  bool reaches(float distance) const
  {
    return heap.size() < k || distance * distance <= heap.front().length;
  }
};

NearestPoints::NearestPoints(const pcl::PointCloud<pcl::PointXYZ>& points,
                             const std::vector<int>& valid)
: axes_(valid.size())
{
  entries_.reserve(valid.size());
  for (const int i : valid)
    entries_.push_back({{points[i].x, points[i].y, points[i].z}, i});
  split(0, entries_.size());
}

void
NearestPoints::split(std::size_t begin, std::size_t end)
{
  if (end - begin <= kLeaf)
    return;
  const auto first = entries_.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = entries_.begin() + static_cast<std::ptrdiff_t>(end);
  std::uint8_t widest = 0;
  float width = -1.0F;
  for (std::uint8_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax_element(first, last, [axis](const Entry& a, const Entry& b) {
          return a.q[axis] < b.q[axis];
        });
    if (high->q[axis] - low->q[axis] > width) {
      width = high->q[axis] - low->q[axis];
      widest = axis;
    }
  }
  const std::size_t middle = begin + (end - begin) / 2;
  std::nth_element(
      first,
      entries_.begin() + static_cast<std::ptrdiff_t>(middle),
      last,
      [widest](const Entry& a, const Entry& b) { return a.q[widest] < b.q[widest]; });
  axes_[middle] = widest;
  split(begin, middle);
  split(middle + 1, end);
}

void
NearestPoints::visit(std::size_t begin, std::size_t end, Query& query) const
{
  if (end - begin <= kLeaf) {
    for (std::size_t i = begin; i < end; ++i)
      query.offer(entries_[i]);
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const std::size_t axis = axes_[middle];
  const float beyond = query.q[axis] - entries_[middle].q[axis];
  query.offer(entries_[middle]);
  if (beyond < 0.0F)
    visit(begin, middle, query);
  else
    visit(middle + 1, end, query);
  if (!query.reaches(beyond))
    return;
  if (beyond < 0.0F)
    visit(middle + 1, end, query);
  else
    visit(begin, middle, query);
}

void
NearestPoints::search(const pcl::PointXYZ& centre,
                      std::size_t k,
                      std::vector<PathEnd>& heap,
                      std::vector<int>& indices) const
{
  heap.clear();
  indices.clear();
  if (k == 0)
    return;
  Query query{{centre.x, centre.y, centre.z}, k, heap};
  visit(0, entries_.size(), query);
  for (const PathEnd& end : heap)
    indices.push_back(end.index);
}

} // namespace holdfast
