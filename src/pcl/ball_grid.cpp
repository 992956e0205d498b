#include "ball_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast {
namespace {

/// Numbers of cubes, both ends included.
struct Range {
  std::int32_t first, last;

  double size() const
  {
    return static_cast<double>(last) - first + 1.0;
  }

  bool holds(std::int32_t i) const
  {
    return i >= first && i <= last;
  }
};

} // namespace

BallGrid::BallGrid(const pcl::PointCloud<pcl::PointXYZ>& points,
                   const std::vector<int>& valid,
                   double edge_m)
: cubes_per_m_(std::min(1.0 / edge_m, 1e100)) // so that 0 stays 0
{
  sortIntoRows(points, valid);
  cutRows();
}

/// Far out all share one cube: slower, no less right.
std::int32_t
BallGrid::cubeOf(double coordinate) const
{
  constexpr double kFarthest = 1e9;
  const double place = std::clamp(coordinate * cubes_per_m_, -kFarthest, kFarthest);
  const auto towards_zero = static_cast<std::int32_t>(place);
  return towards_zero - (place < towards_zero ? 1 : 0); // floor() is a call
}

std::uint64_t
BallGrid::rowKey(std::int32_t y, std::int32_t z)
{
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
         static_cast<std::uint32_t>(z);
}

/// By counting; the order within a row is that of the indices.
void
BallGrid::sortIntoRows(const pcl::PointCloud<pcl::PointXYZ>& points,
                       const std::vector<int>& valid)
{
  const auto keyOf = [&](int i) {
    return rowKey(cubeOf(points[i].y), cubeOf(points[i].z));
  };
  for (const int i : valid)
    ++rows_[keyOf(i)].end;
  std::uint32_t begin = 0;
  for (auto& [key, row] : rows_) {
    const std::uint32_t size = row.end;
    row = {begin, begin};
    begin += size;
  }
  entries_.resize(valid.size());
  for (const int i : valid) {
    const pcl::PointXYZ& p = points[i];
    entries_[rows_[keyOf(i)].end++] = {p.x, p.y, p.z, i};
  }
}

/// From here on, rows count cubes, no points.
void
BallGrid::cutRows()
{
  for (auto& [key, row] : rows_) {
    const auto first = entries_.begin() + row.begin, last = entries_.begin() + row.end;
    std::sort(first, last, [this](const Entry& a, const Entry& b) {
      const std::int32_t cube_a = cubeOf(a.x), cube_b = cubeOf(b.x);
      return cube_a != cube_b ? cube_a < cube_b : a.index < b.index;
    });
    std::uint32_t entry = row.begin;
    row.begin = static_cast<std::uint32_t>(cubes_.size());
    for (auto e = first; e != last; ++e, ++entry)
      if (const std::int32_t x = cubeOf(e->x); e == first || cubes_.back().x != x)
        cubes_.push_back({x, entry});
    row.end = static_cast<std::uint32_t>(cubes_.size());
  }
  cubes_.push_back({0, static_cast<std::uint32_t>(entries_.size())});
}

void
BallGrid::searchRow(const Row& row,
                    const pcl::PointXYZ& centre,
                    double radius,
                    std::vector<int>& indices) const
{
  const auto before = [](const Cube& cube, std::int32_t x) { return cube.x < x; };
  const auto last = cubes_.begin() + row.end;
  const auto from = std::lower_bound(cubes_.begin() + row.begin,
                                     last,
                                     cubeOf(centre.x - radius),
                                     before);
  const std::int32_t x_end = cubeOf(centre.x + radius);
  auto to = from;
  while (to != last && to->x <= x_end)
    ++to;
  const auto squared_radius = static_cast<float>(radius * radius);
  for (std::uint32_t i = from->begin; i < to->begin; ++i) {
    const Entry& e = entries_[i];
    const float dx = centre.x - e.x, dy = centre.y - e.y, dz = centre.z - e.z;
    if (dx * dx + dy * dy + dz * dz < squared_radius)
      indices.push_back(e.index);
  }
}

void
BallGrid::search(const pcl::PointXYZ& centre,
                 double radius,
                 std::vector<int>& indices) const
{
  indices.clear();
  const Range y{cubeOf(centre.y - radius), cubeOf(centre.y + radius)};
  const Range z{cubeOf(centre.z - radius), cubeOf(centre.z + radius)};
  if (y.size() * z.size() > static_cast<double>(rows_.size())) {
    // Many cubes wide: there are fewer rows than places for them.
    for (const auto& [key, row] : rows_)
      if (y.holds(static_cast<std::int32_t>(key >> 32U)) &&
          z.holds(static_cast<std::int32_t>(key & 0xffffffffU)))
        searchRow(row, centre, radius, indices);
  }
  else
    for (std::int32_t v = y.first; v <= y.last; ++v)
      for (std::int32_t w = z.first; w <= z.last; ++w)
        if (const auto row = rows_.find(rowKey(v, w)); row != rows_.end())
          searchRow(row->second, centre, radius, indices);
  std::sort(indices.begin(), indices.end());
}

} // namespace holdfast
