#include "seeds.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <unordered_map>

namespace holdfast {

namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

Eigen::Vector3d
position(const Points& points, int index)
{
  return points[index].getVector3fMap().cast<double>();
}

/// A cell of the voxel grid; whole numbers, kept as double so that no cloud is too
/// large for them.
using Cell = std::array<double, 3>;

Cell
cellOf(const Eigen::Vector3d& p, double size)
{
  return {std::floor(p.x() / size), std::floor(p.y() / size), std::floor(p.z() / size)};
}

struct CellHash {
  std::size_t operator()(const Cell& cell) const
  {
    // + 0.0 makes -0 and 0, which are equal, hash alike.
    std::size_t hash = 0;
    for (const double i : cell)
      hash = hash * 1000003U ^ std::hash<double>{}(i + 0.0);
    return hash;
  }
};

template <typename T>
using CellMap = std::unordered_map<Cell, T, CellHash>;

/// A uniform number below `bound`. The distributions of the standard library differ
/// between implementations; this does not.
std::size_t
drawBelow(std::size_t bound, std::mt19937_64& generator)
{
  const std::uint64_t n = bound;
  // Numbers from the last, incomplete multiple of n would favour the small remainders.
  const std::uint64_t limit =
      std::mt19937_64::max() - (std::mt19937_64::max() % n + 1) % n;
  std::uint64_t draw = generator();
  while (draw > limit)
    draw = generator();
  return static_cast<std::size_t>(draw % n);
}

/// The first `count` steps of a Fisher-Yates shuffle.
void
shuffleFront(std::vector<int>& values, std::size_t count, std::mt19937_64& generator)
{
  for (std::size_t i = 0; i < count; ++i)
    std::swap(values[i], values[i + drawBelow(values.size() - i, generator)]);
}

std::size_t
validCount(const PixelGrid& grid)
{
  return static_cast<std::size_t>(
      std::count_if(grid.depth.begin(), grid.depth.end(), [](float z) {
        return !std::isnan(z);
      }));
}

/// Median of the valid depths, of a regular sample of them in a large image.
float
medianDepth(const PixelGrid& grid)
{
  constexpr std::size_t kEnough = 20000;
  const std::size_t step = std::max<std::size_t>(1, validCount(grid) / kEnough);
  std::vector<float> depth;
  std::size_t valid = 0;
  for (const float z : grid.depth)
    if (!std::isnan(z) && valid++ % step == 0)
      depth.push_back(z);
  if (depth.empty())
    return std::numeric_limits<float>::quiet_NaN();
  const auto middle = depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2);
  std::nth_element(depth.begin(), middle, depth.end());
  return *middle;
}

/// Pixels half a step from the border and then one step apart, as far as valid.
std::vector<int>
pixelsEvery(const PixelGrid& grid, double column_step, double row_step)
{
  std::vector<int> seeds;
  for (double v = 0.5 * row_step; v < grid.camera.height; v += row_step) {
    const float* row = grid.row(static_cast<int>(v));
    for (double u = 0.5 * column_step; u < grid.camera.width; u += column_step)
      if (!std::isnan(row[static_cast<int>(u)]))
        seeds.push_back(static_cast<int>(v) * grid.camera.width + static_cast<int>(u));
  }
  return seeds;
}

std::vector<int>
onePerVoxel(const Points& points, const std::vector<int>& valid, double size)
{
  struct Nearest {
    double distance = std::numeric_limits<double>::infinity();
    int index = 0;
  };
  CellMap<Nearest> voxels;
  for (const int i : valid) {
    const Eigen::Vector3d p = position(points, i);
    const Cell cell = cellOf(p, size);
    const Eigen::Vector3d centre =
        size * (Eigen::Vector3d(cell[0], cell[1], cell[2]).array() + 0.5).matrix();
    Nearest& nearest = voxels[cell];
    const double distance = (p - centre).squaredNorm();
    if (distance < nearest.distance)
      nearest = {distance, i};
  }
  std::vector<int> seeds;
  seeds.reserve(voxels.size());
  for (const auto& voxel : voxels)
    seeds.push_back(voxel.second.index);
  std::sort(seeds.begin(), seeds.end());
  return seeds;
}

/// Calls seedsAt(scale) with spacings `scale` times as large until no more than
/// max_seeds come: their number falls with the square of the scale on a surface.
template <typename SeedsAt>
std::vector<int>
coarsenedTo(int max_seeds, SeedsAt&& seedsAt)
{
  constexpr double kSmallestGrowth = 1.02;
  double scale = 1.0;
  std::vector<int> seeds = seedsAt(scale);
  while (max_seeds > 0 && seeds.size() > static_cast<std::size_t>(max_seeds)) {
    const double excess = static_cast<double>(seeds.size()) / max_seeds;
    scale *= std::max(std::sqrt(excess), kSmallestGrowth);
    seeds = seedsAt(scale);
  }
  return seeds;
}

/// Points in buckets of one spacing: any two closer than it are in adjacent ones.
class SpacedPoints {
public:
  explicit SpacedPoints(double spacing) : spacing_(spacing) {}

  /// Adds the point unless one nearer than the spacing is there.
  bool addIfFree(const Eigen::Vector3d& p)
  {
    const Cell cell = cellOf(p, spacing_);
    if (isBlocked(p, cell))
      return false;
    buckets_[cell].push_back(p);
    return true;
  }

private:
  bool isBlocked(const Eigen::Vector3d& p, const Cell& cell) const
  {
    // The own cell first: it is where a near point most likely is.
    for (const double dx : {0.0, -1.0, 1.0})
      for (const double dy : {0.0, -1.0, 1.0})
        for (const double dz : {0.0, -1.0, 1.0})
          if (isBlockedIn({cell[0] + dx, cell[1] + dy, cell[2] + dz}, p))
            return true;
    return false;
  }

  bool isBlockedIn(const Cell& cell, const Eigen::Vector3d& p) const
  {
    const auto bucket = buckets_.find(cell);
    if (bucket == buckets_.end())
      return false;
    return std::any_of(bucket->second.begin(),
                       bucket->second.end(),
                       [&](const Eigen::Vector3d& other) {
                         return (p - other).squaredNorm() < spacing_ * spacing_;
                       });
  }

  double spacing_;
  CellMap<std::vector<Eigen::Vector3d>> buckets_;
};

} // namespace

std::vector<int>
pixelGridSeeds(const PixelGrid& grid, double spacing_m, int max_seeds)
{
  const double depth = medianDepth(grid);
  if (std::isnan(depth))
    return {};
  return coarsenedTo(max_seeds, [&](double scale) {
    const double slope = scale * spacing_m / depth;
    const auto stepOf = [slope](double focal, int size) {
      return std::clamp(slope * focal, 1.0, static_cast<double>(size));
    };
    return pixelsEvery(grid,
                       stepOf(grid.camera.fx, grid.camera.width),
                       stepOf(grid.camera.fy, grid.camera.height));
  });
}

std::vector<int>
voxelGridSeeds(const Points& points,
               const std::vector<int>& valid,
               double spacing_m,
               int max_seeds)
{
  return coarsenedTo(max_seeds, [&](double scale) {
    return onePerVoxel(points, valid, scale * spacing_m);
  });
}

std::vector<int>
randomSeeds(std::vector<int> valid, std::size_t count, std::uint64_t random_seed)
{
  std::mt19937_64 generator(random_seed);
  count = std::min(count, valid.size());
  shuffleFront(valid, count, generator);
  valid.resize(count);
  return valid;
}

std::vector<int>
poissonSeeds(const Points& points,
             std::vector<int> valid,
             double spacing_m,
             int max_seeds,
             std::uint64_t random_seed)
{
  std::mt19937_64 generator(random_seed);
  shuffleFront(valid, valid.size(), generator);
  const std::size_t limit =
      max_seeds > 0 ? static_cast<std::size_t>(max_seeds) : valid.size();
  SpacedPoints kept(spacing_m);
  std::vector<int> seeds;
  for (const int i : valid) {
    if (seeds.size() == limit)
      break;
    if (kept.addIfFree(position(points, i)))
      seeds.push_back(i);
  }
  return seeds;
}

} // namespace holdfast
