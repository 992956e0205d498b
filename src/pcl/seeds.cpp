#include "seeds.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
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

/// The nearest valid depth; infinite without any.
float
nearestDepth(const PixelGrid& grid)
{
  float nearest = std::numeric_limits<float>::infinity();
  for (const float z : grid.depth)
    if (z < nearest)
      nearest = z;
  return nearest;
}

/// The rays of the columns, or rows, of an image.
class RaysAlong {
public:
  RaysAlong(double focal, double centre, int size)
  : focal_(focal), centre_(centre), size_(size)
  {
    for (int i = 0; i < size; ++i) {
      const double slope = (i - centre) / focal;
      rays_.push_back({slope, std::sqrt(1.0 + slope * slope)});
    }
  }

  /// x/z, or y/z.
  double slope(int pixel) const
  {
    return rays_[static_cast<std::size_t>(pixel)].slope;
  }

  /// Those that may meet a ball about the point at depth z of a pixel's ray, whose
  /// tangents are at s = (x z -+ r sqrt(x^2 + z^2 - r^2)) / (z^2 - r^2): a bound to
  /// that without the root. \param scale 1 / (z^2 - r^2).
  PixelRange about(int pixel, double z, double r, double scale) const
  {
    if (z <= r)
      return {0, size_};
    const Ray& ray = rays_[static_cast<std::size_t>(pixel)];
    const double middle = focal_ * (z * z * scale * ray.slope) + centre_;
    const double half = focal_ * (z * r * scale * ray.stretch);
    const auto toPixel = [this](double p) {
      return static_cast<int>(std::clamp(p, 0.0, static_cast<double>(size_)));
    };
    return {toPixel(middle - half), toPixel(middle + half + 1.0)};
  }

private:
  struct Ray {
    double slope;
    double stretch; ///< its length over its depth, in the plane of the axis
  };

  double focal_, centre_;
  int size_;
  std::vector<Ray> rays_;
};

/// Seeds on the pixels of a camera, in lists by cells of the image.
class SeedsInImage {
public:
  SeedsInImage(const PixelGrid& grid, double spacing, int cell_px)
  : grid_(grid)
  , spacing_(spacing)
  , along_row_(grid.camera.fx, grid.camera.cx, grid.camera.width)
  , along_column_(grid.camera.fy, grid.camera.cy, grid.camera.height)
  , cell_px_(cell_px)
  , columns_((grid.camera.width + cell_px - 1) / cell_px)
  , rows_((grid.camera.height + cell_px - 1) / cell_px)
  , first_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone)
  , words_(columns_ / kBits + 1)
  , has_seeds_(static_cast<std::size_t>(words_) * static_cast<std::size_t>(rows_))
  {}

  /// Adds the pixel unless a seed is nearer than the spacing. \return the distance to
  /// one such seed, 0 when there is none.
  double addIfFree(int u, int v)
  {
    const Eigen::Vector3d p = pointAt(u, v);
    const double z = p.z();
    const double scale = 1.0 / (z * z - spacing_ * spacing_);
    const auto cells = [this](const PixelRange& pixels, int count) {
      return PixelRange{pixels.begin / cell_px_,
                        std::min((pixels.end - 1) / cell_px_ + 1, count)};
    };
    const PixelRange columns = cells(along_row_.about(u, z, spacing_, scale), columns_);
    // No seed is in a row to come.
    const PixelRange rows =
        cells(along_column_.about(v, z, spacing_, scale), v / cell_px_ + 1);
    for (int row = rows.begin; row < rows.end; ++row)
      for (int column = nextSeeds(columns.begin, columns.end, row);
           column < columns.end;
           column = nextSeeds(column + 1, columns.end, row))
        for (int i = first_[cellAt(column, row)]; i != kNone; i = seeds_[i].next) {
          const double squared = (seeds_[i].point - p).squaredNorm();
          if (squared < spacing_ * spacing_)
            return std::sqrt(squared);
        }
    setSeeds(u / cell_px_, v / cell_px_);
    int& first = first_[cellAt(u / cell_px_, v / cell_px_)];
    seeds_.push_back({p, v * grid_.camera.width + u, first});
    first = static_cast<int>(seeds_.size()) - 1;
    return 0.0;
  }

  std::vector<int> pixels() const
  {
    std::vector<int> pixels;
    for (const Seed& seed : seeds_)
      pixels.push_back(seed.pixel);
    return pixels;
  }

private:
  static constexpr int kNone = -1;

  struct Seed {
    Eigen::Vector3d point;
    int pixel;
    int next; ///< in the same cell
  };

  Eigen::Vector3d pointAt(int u, int v) const
  {
    return grid_.row(v)[u] *
           Eigen::Vector3d(along_row_.slope(u), along_column_.slope(v), 1.0);
  }

  std::size_t cellAt(int column, int row) const
  {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  std::uint64_t& wordAt(int column, int row)
  {
    return has_seeds_[static_cast<std::size_t>(row * words_ + column / kBits)];
  }

  void setSeeds(int column, int row)
  {
    wordAt(column, row) |= std::uint64_t{1} << (column % kBits);
  }

  /// The next cell with seeds from a column on; no less than `end` when there is none.
  int nextSeeds(int column, int end, int row)
  {
    for (; column < end; column = (column / kBits + 1) * kBits) {
      const std::uint64_t left = wordAt(column, row) >> (column % kBits);
      if (left != 0)
        return column + __builtin_ctzll(left);
    }
    return end;
  }

  static constexpr int kBits = 64;

  const PixelGrid& grid_;
  double spacing_;
  RaysAlong along_row_, along_column_;
  int cell_px_, columns_, rows_;
  std::vector<int> first_;
  int words_; ///< of has_seeds_, for a row of cells
  std::vector<std::uint64_t> has_seeds_; ///< a bit for each cell: most are empty
  std::vector<Seed> seeds_;
};

/// Pixels in the order of rows, each unless one before is nearer in space. Steps of a
/// quarter of the spacing find nearly as many as all pixels would.
std::vector<int>
spacedPixels(const PixelGrid& grid, double spacing)
{
  const Camera& camera = grid.camera;
  const float nearest = nearestDepth(grid);
  if (std::isinf(nearest))
    return {};
  // Rows as dense as the farthest pixels of a room want them.
  constexpr double kDeepest = 4.0; // times the nearest
  constexpr double kMostPixels = 1e6; // wider than images are
  const auto pixelsOf = [=](double length, double focal, double depth) {
    return static_cast<int>(std::clamp(length * focal / depth, 1.0, kMostPixels));
  };
  const int row_step = pixelsOf(0.25 * spacing, camera.fy, kDeepest * nearest);
  SeedsInImage seeds(grid, spacing, pixelsOf(spacing, camera.fx, kDeepest * nearest));
  for (int v = row_step / 2; v < camera.height; v += row_step) {
    const float* row = grid.row(v);
    for (int u = 0; u < camera.width;) {
      if (std::isnan(row[u])) {
        ++u;
        continue;
      }
      // What lies d from a seed is free after spacing - d at the earliest.
      const double blocked = seeds.addIfFree(u, v);
      u += pixelsOf(std::max(0.25 * spacing, spacing - blocked), camera.fx, row[u]);
    }
  }
  return seeds.pixels();
}

} // namespace

std::vector<int>
pixelGridSeeds(const PixelGrid& grid, double spacing_m, int max_seeds)
{
  return coarsenedTo(max_seeds, [&](double scale) {
    return spacedPixels(grid, scale * spacing_m);
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
