/// \file Shortest paths from a seed over any graph.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

namespace holdfast {

struct PathEnd {
  float length;
  int index;
};

/// Shortest first; by index where lengths are equal, so that the order is definite.
inline bool
operator>(const PathEnd& a, const PathEnd& b)
{
  return a.length != b.length ? a.length > b.length : a.index > b.index;
}

/// Paths that grow from a seed, shortest first (Dijkstra). Lengths are kept by slot;
/// `infinity` marks slots not reached yet.
class PathSearch {
public:
  PathSearch(std::vector<PathEnd>& heap,
             std::vector<float>& length,
             std::size_t slots,
             float longest)
  : heap_(heap), length_(length), longest_(longest)
  {
    heap_.clear();
    length_.assign(slots, std::numeric_limits<float>::infinity());
  }

  void reach(int slot, float length)
  {
    float& known = length_[static_cast<std::size_t>(slot)];
    if (length > longest_ || length >= known)
      return;
    known = length;
    heap_.push_back({length, slot});
    std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
  }

  /// Calls grow(slot, length) for each slot within reach, once.
  template <typename Grow>
  void run(Grow&& grow)
  {
    while (!heap_.empty()) {
      std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
      const PathEnd end = heap_.back();
      heap_.pop_back();
      if (end.length == length_[static_cast<std::size_t>(end.index)])
        grow(end.index, end.length);
    }
  }

  bool isReached(int slot) const
  {
    return length_[static_cast<std::size_t>(slot)] <= longest_;
  }

private:
  std::vector<PathEnd>& heap_;
  std::vector<float>& length_;
  float longest_;
};

} // namespace holdfast
