#include "regions.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <map>
#include <tuple>

namespace holdfast {
namespace {

constexpr int kSeedTiles = 4; // along the side of a seed
constexpr int kLeastPlaneTiles = 36;

// Variance of one plane to a seed over that of planes to its tiles. A fixed pattern
// alone doubles or trebles it; a spot that must not bend at all may only be a tenth
// above, which noise alone does not reach.
constexpr double kLargestSeedRatio = 4.0;
constexpr double kLargestSpotRatio = 1.1;

// A tile belongs to a plane when its rms distance is below three sigmas of the plane.
// Sensors bend large planes, so that sigma may grow with the plane, but only so far.
constexpr double kTileSigmas = 3.0;
constexpr double kLargestSigmaGrowth = 3.0;

// Of a surface that counts as flat, 1/m. Sensors bend planes by less than 0.1; the
// waves of their pattern bend pieces of 128 px by 0.2 to 0.5, and bumpy ground does by
// more.
constexpr double kLargestCurvature = 0.25;
constexpr double kLargestPieceCurvature = 0.75;
constexpr int kPieceSizes[] = {128, 64}; // px

PlaneMoments
momentsOf(const TileImage& image, const Region& region)
{
  PlaneMoments sum;
  for (const int i : region)
    sum += image[i].mean;
  return sum;
}

struct Seed {
  Region tiles;
  double variance = 0.0;
};

/// Squares of usable tiles that are about as flat as these, the flattest first.
std::vector<Seed>
findSeeds(const TileImage& image, double largest_ratio)
{
  std::vector<Seed> seeds;
  for (int row = 0; row + kSeedTiles <= image.rows; row += kSeedTiles)
    for (int column = 0; column + kSeedTiles <= image.columns; column += kSeedTiles) {
      Seed seed;
      double squares = 0.0, dof = 0.0;
      for (int k = 0; k < kSeedTiles * kSeedTiles; ++k) {
        const int i = image.index(column + k % kSeedTiles, row + k / kSeedTiles);
        const Tile& tile = image[i];
        if (!tile.usable)
          break;
        seed.tiles.push_back(i);
        squares += tile.mean.residual(tile.mean.plane());
        dof += tile.mean.count - 3.0;
      }
      if (seed.tiles.size() < kSeedTiles * kSeedTiles)
        continue;
      seed.variance = momentsOf(image, seed.tiles).variance();
      if (seed.variance <= largest_ratio * squares / dof)
        seeds.push_back(seed);
    }
  std::stable_sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.variance < b.variance;
  });
  return seeds;
}

/// Calls use(index) for a tile and those around it.
template <typename Use>
void
forEachNeighbor(const TileImage& image, int index, Use&& use)
{
  const int column = index % image.columns, row = index / image.columns;
  for (int v = std::max(row - 1, 0); v <= std::min(row + 1, image.rows - 1); ++v)
    for (int u = std::max(column - 1, 0); u <= std::min(column + 1, image.columns - 1);
         ++u)
      use(image.index(u, v));
}

/// The tiles that lie on the plane of a region, in one piece with it.
Region
regrown(const TileImage& image,
        const std::vector<bool>& taken,
        const Region& region,
        double largest_sigma)
{
  const PlaneMoments moments = momentsOf(image, region);
  const DisparityPlane plane = moments.plane();
  const double sigma = std::min(std::sqrt(moments.variance()), largest_sigma);
  Region next;
  std::vector<bool> seen = taken;
  const auto consider = [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (seen[i] || !image.tiles[i].usable)
      return;
    seen[i] = true;
    const PlaneMoments& tile = image.tiles[i].mean;
    if (std::sqrt(tile.residual(plane) / tile.count) <= kTileSigmas * sigma)
      next.push_back(index);
  };
  for (const int index : region)
    consider(index);
  for (std::size_t k = 0; k < next.size(); ++k)
    forEachNeighbor(image, next[k], consider);
  std::sort(next.begin(), next.end());
  return next;
}

/// Grows a seed, with ever better planes, until it grows no more.
Region
grow(const TileImage& image, const std::vector<bool>& taken, const Seed& seed)
{
  const double largest_sigma = kLargestSigmaGrowth * std::sqrt(seed.variance);
  Region region = seed.tiles;
  for (bool grows = true; grows;) {
    Region next = regrown(image, taken, region, largest_sigma);
    if (next.size() < seed.tiles.size())
      return {};
    grows = next.size() > region.size();
    region = std::move(next);
  }
  return region;
}

/// The larger principal curvature, 1/m, of the surface on which the tiles lie. On
/// z = z0 + kappa X^2 / 2 seen from the front, with X = x z and x = (u - cx) / fx,
///
///   d = f b / z = f b / z0 - f b kappa x^2 / 2 + ...,
///
/// so that the second derivative of d is -f b kappa at any distance. On tilted planes
/// it is that much less sensitive as their curvature disturbs less.
double
curvatureOf(const TileImage& image,
            const Region& region,
            const NoiseCalibrationOptions& options)
{
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6d b = Vector6d::Zero();
  const Eigen::Vector3d middle = momentsOf(image, region).mean;
  for (const int i : region) {
    const PlaneMoments& tile = image[i].mean;
    const Eigen::Vector3d q = tile.mean - middle;
    const double x = q.x() / options.camera.fx, y = q.y() / options.camera.fy;
    Vector6d terms;
    terms << 1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y;
    A += tile.count * terms * terms.transpose();
    b += tile.count * terms * q.z();
  }
  const Vector6d c = A.ldlt().solve(b);
  Eigen::Matrix2d hessian;
  hessian << c[3], c[4], c[4], c[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(hessian,
                                                             Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().cwiseAbs().maxCoeff() /
         (options.focal_px * options.baseline_m);
}

/// Tiles at the rim may straddle an edge that is too low to show. Three neighbours are
/// missing along a straight one, and fewer beside a single tile that was dropped.
Region
withoutRim(const TileImage& image, const Region& region)
{
  std::vector<bool> inside(image.tiles.size(), false);
  for (const int i : region)
    inside[static_cast<std::size_t>(i)] = true;
  Region interior;
  for (const int i : region) {
    int missing = 0;
    forEachNeighbor(image, i, [&](int k) {
      missing += !inside[static_cast<std::size_t>(k)];
    });
    if (missing < 3)
      interior.push_back(i);
  }
  return interior;
}

/// Not bent as a whole, nor in most of its pieces: large ones, so that the noise does
/// not bend them, unless the region is too slender to have many.
bool
isFlat(const TileImage& image,
       const Region& region,
       const NoiseCalibrationOptions& options)
{
  if (region.size() < kLeastPlaneTiles ||
      !(curvatureOf(image, region, options) <= kLargestCurvature))
    return false;
  for (const int size_px : kPieceSizes) {
    std::size_t tiles = 0;
    std::vector<double> curvatures;
    for (const Region& piece : cutRegions({true, {region}}, image, size_px)) {
      tiles += piece.size();
      curvatures.push_back(curvatureOf(image, piece, options));
    }
    if (2 * tiles < region.size())
      continue;
    std::sort(curvatures.begin(), curvatures.end());
    return curvatures[curvatures.size() / 2] <= kLargestPieceCurvature;
  }
  return false;
}

} // namespace

FlatRegions
findFlatRegions(const TileImage& image, const NoiseCalibrationOptions& options)
{
  FlatRegions flat;
  std::vector<bool> taken(image.tiles.size(), false);
  for (const Seed& seed : findSeeds(image, kLargestSeedRatio)) {
    const bool is_free = std::none_of(seed.tiles.begin(), seed.tiles.end(), [&](int i) {
      return taken[static_cast<std::size_t>(i)];
    });
    if (!is_free)
      continue;
    const Region region = withoutRim(image, grow(image, taken, seed));
    if (!isFlat(image, region, options))
      continue;
    for (const int i : region)
      taken[static_cast<std::size_t>(i)] = true;
    flat.regions.push_back(region);
  }
  flat.are_planes = !flat.regions.empty();
  if (!flat.are_planes)
    for (const Seed& spot : findSeeds(image, kLargestSpotRatio))
      flat.regions.push_back(spot.tiles);
  return flat;
}

std::vector<Region>
cutRegions(const FlatRegions& flat, const TileImage& image, int size_px)
{
  if (size_px == 0)
    return flat.regions;
  const int tiles = size_px / kTileSize;
  std::map<std::tuple<int, int, int>, Region> squares;
  for (std::size_t k = 0; k < flat.regions.size(); ++k)
    for (const int i : flat.regions[k])
      squares[{static_cast<int>(k),
               i / image.columns / tiles,
               i % image.columns / tiles}]
          .push_back(i);
  std::vector<Region> pieces;
  for (const auto& [key, square] : squares)
    if (2 * static_cast<int>(square.size()) >= tiles * tiles)
      pieces.push_back(square);
  return pieces;
}

} // namespace holdfast
