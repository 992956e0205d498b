#include <holdfast/sensor/noise_calibration.h>

#include "noise_calibration_jackknife.h"
#include "noise_calibration_regions.h"
#include "noise_calibration_step.h"

#include <holdfast/geometry/constants.h>

#include <algorithm>
#include <stdexcept>

namespace holdfast {
namespace {

constexpr int kCellColumns = 8;
constexpr int kCellRows = 6;

constexpr int kRegionSizes[] = {8, 16, 32, 64, 128, 0}; // px; 0: whole planes

// Single precision of the points scatters them by 1e-4 px.
constexpr double kOnTheGridPx = 0.01;

constexpr std::size_t kDepthRows = 6;
constexpr std::size_t kLeastTilesInRow = 40;

/// What a tile adds to the estimates.
struct TileSums {
  int tile = 0;
  CellSums sums;
};

/// Indices of TileSums::sums.
enum Sum {
  Single, ///< squared residuals within frames, px^2
  SingleDof,
  Mean, ///< squared residuals of the mean of the frames, px^2
  MeanDof,
  Temporal, ///< squared deviations from the mean of each pixel, px^2
  TemporalDof,
  Pixels,
  InverseCounts, ///< of the frames of a pixel
  Scatter, ///< squared distances from the ray grid, px^2
  ScatterDof,
  LogDepth, ///< this and the following weighted with SingleDof
  LogDepth2,
  SingleLogDepth, ///< squared residuals times log depth
  kSums
};

/// Numbers of the image cells of all tiles.
std::vector<int>
cellsOf(const TileImage& image)
{
  std::vector<int> cells;
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.columns; ++column)
      cells.push_back(row * kCellRows / image.rows * kCellColumns +
                      column * kCellColumns / image.columns);
  return cells;
}

/// Residuals of the tiles of a region to its plane. A plane takes 3 degrees of freedom,
/// which its tiles share.
void
addResiduals(const TileImage& image,
             const Region& region,
             const PlaneMoments& whole,
             int frame, ///< -1: the mean of all
             std::vector<TileSums>& out)
{
  const DisparityPlane plane = whole.plane();
  for (std::size_t k = 0; k < region.size(); ++k) {
    const Tile& tile = image.tiles[static_cast<std::size_t>(region[k])];
    const PlaneMoments& moments =
        frame < 0 ? tile.mean : tile.frames[static_cast<std::size_t>(frame)];
    const double dof = moments.count * (1.0 - 3.0 / whole.count);
    const double squares = moments.residual(plane);
    Eigen::ArrayXd& sums = out[k].sums.sums;
    if (frame < 0) {
      sums[Mean] += squares;
      sums[MeanDof] += dof;
      continue;
    }
    const double log_depth = std::log(tile.depth_m);
    sums[Single] += squares;
    sums[SingleDof] += dof;
    sums[LogDepth] += dof * log_depth;
    sums[LogDepth2] += dof * log_depth * log_depth;
    sums[SingleLogDepth] += squares * log_depth;
    out[k].sums.weight += dof;
  }
}

std::vector<TileSums>
sumsOf(const TileImage& image, const Region& region)
{
  PlaneMoments mean;
  std::vector<PlaneMoments> frames(image.tiles.front().frames.size());
  std::vector<TileSums> result;
  for (const int i : region) {
    const Tile& tile = image.tiles[static_cast<std::size_t>(i)];
    mean += tile.mean;
    for (std::size_t t = 0; t < frames.size(); ++t)
      frames[t] += tile.frames[t];
    Eigen::ArrayXd sums = Eigen::ArrayXd::Zero(kSums);
    sums[Temporal] = tile.temporal;
    sums[TemporalDof] = tile.temporal_dof;
    sums[Pixels] = tile.mean.count;
    sums[InverseCounts] = tile.inverse_counts;
    sums[Scatter] = tile.scatter;
    sums[ScatterDof] = tile.scatter_dof;
    result.push_back({i, {0.0, sums}});
  }
  addResiduals(image, region, mean, -1, result);
  // A frame in which something stood before most of the region says little about it.
  for (std::size_t t = 0; t < frames.size(); ++t)
    if (frames[t].hasPlane() && frames[t].count > 0.5 * mean.count)
      addResiduals(image, region, frames[t], static_cast<int>(t), result);
  return result;
}

std::vector<TileSums>
sumsOf(const TileImage& image, const std::vector<Region>& regions)
{
  std::vector<TileSums> all;
  for (const Region& region : regions) {
    const std::vector<TileSums> some = sumsOf(image, region);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

std::vector<CellSums>
byCell(const std::vector<TileSums>& tiles, const std::vector<int>& cells)
{
  std::vector<CellSums> result(kCellColumns * kCellRows,
                               {0.0, Eigen::ArrayXd::Zero(kSums)});
  for (const TileSums& tile : tiles) {
    CellSums& cell =
        result[static_cast<std::size_t>(cells[static_cast<std::size_t>(tile.tile)])];
    cell.weight += tile.sums.weight;
    cell.sums += tile.sums.sums;
  }
  return result;
}

// Variances, px^2. Without frames to compare, 0 / 0 makes them NaN.

double
singleVariance(const Eigen::ArrayXd& s)
{
  return s[Single] / s[SingleDof];
}

double
temporalVariance(const Eigen::ArrayXd& s)
{
  return s[Temporal] / s[TemporalDof];
}

/// The mean of n frames still holds 1/n of the temporal variance.
double
fixedVariance(const Eigen::ArrayXd& s)
{
  return s[Mean] / s[MeanDof] - temporalVariance(s) * s[InverseCounts] / s[Pixels];
}

DisparitySigmas
sigmasOf(const std::vector<CellSums>& cells)
{
  return {rootOf(jackknife(cells, singleVariance)),
          rootOf(jackknife(cells, temporalVariance)),
          rootOf(jackknife(cells, fixedVariance))};
}

/// Where a plane crosses many steps, the rounding error is uniform and independent of
/// the noise, however small that is, and adds q^2 / 12 to the residual. Two frames
/// share part of it: see roundedTemporalVariance().
DisparitySigmas
unrounded(const std::vector<CellSums>& cells, double quantum)
{
  const auto single = [quantum](const Eigen::ArrayXd& s) {
    return singleVariance(s) - quantum * quantum / 12.0;
  };
  const auto temporal = [quantum](const Eigen::ArrayXd& s) {
    return std::pow(sigmaBeforeRounding(temporalVariance(s), quantum), 2);
  };
  const auto fixed = [&](const Eigen::ArrayXd& s) { return single(s) - temporal(s); };
  return {rootOf(jackknife(cells, single)),
          rootOf(jackknife(cells, temporal)),
          rootOf(jackknife(cells, fixed))};
}

/// With variance = alpha + beta (log z - mean log z) by weighted least squares,
/// p = d log sigma / d log z = beta / (2 alpha).
double
depthExponent(const Eigen::ArrayXd& s)
{
  const double n = s[SingleDof];
  const double beta = (s[SingleLogDepth] - s[Single] * s[LogDepth] / n) /
                      (s[LogDepth2] - s[LogDepth] * s[LogDepth] / n);
  return 0.5 * beta / singleVariance(s);
}

Estimate
scatterAcrossRays(const std::vector<CellSums>& cells)
{
  const Estimate sigma = rootOf(jackknife(cells, [](const Eigen::ArrayXd& s) {
    return s[Scatter] / s[ScatterDof];
  }));
  return sigma.value > kOnTheGridPx ? sigma : Estimate{};
}

/// Rows of about as many tiles each.
std::vector<DepthRow>
byDepth(const TileImage& image,
        std::vector<TileSums> tiles,
        const std::vector<int>& cells)
{
  const auto depth = [&image](const TileSums& tile) {
    return image.tiles[static_cast<std::size_t>(tile.tile)].depth_m;
  };
  std::stable_sort(tiles.begin(), tiles.end(), [&](const auto& a, const auto& b) {
    return depth(a) < depth(b);
  });
  const std::size_t count =
      std::clamp<std::size_t>(tiles.size() / kLeastTilesInRow, 1, kDepthRows);
  std::vector<DepthRow> rows;
  for (std::size_t k = 0; k < count; ++k) {
    const auto at = [&](std::size_t i) {
      return tiles.begin() + static_cast<std::ptrdiff_t>(i * tiles.size() / count);
    };
    const std::vector<TileSums> some(at(k), at(k + 1));
    DepthRow& row = rows.emplace_back();
    row.min_m = depth(some.front());
    row.max_m = depth(some.back());
    double pixels = 0.0;
    for (const TileSums& tile : some) {
      pixels += tile.sums.sums[Pixels];
      row.mean_m += tile.sums.sums[Pixels] * depth(tile);
    }
    row.mean_m /= pixels;
    row.pixels = static_cast<int>(pixels);
    row.sigmas = sigmasOf(byCell(some, cells));
  }
  return rows;
}

std::vector<RegionSizeRow>
byRegionSize(const TileImage& image,
             const FlatRegions& flat,
             const std::vector<int>& cells)
{
  std::vector<RegionSizeRow> rows;
  for (const int size : kRegionSizes) {
    // Within small spots only small tiles are known to be flat.
    if (!flat.are_planes && size != kTileSize)
      continue;
    const std::vector<Region> regions = cutRegions(flat, image, size);
    const Estimate single =
        rootOf(jackknife(byCell(sumsOf(image, regions), cells), singleVariance));
    if (single.isKnown())
      rows.push_back({size, static_cast<int>(regions.size()), single});
  }
  return rows;
}

void
requireSameSizes(const std::vector<PointImage>& frames)
{
  if (frames.empty())
    throw std::invalid_argument("there is no frame");
  const PointImage& first = frames.front();
  for (const PointImage& frame : frames) {
    if (frame.width != first.width || frame.height != first.height)
      throw std::invalid_argument("the frames differ in size");
    if (frame.width < 1 || frame.height < 1 ||
        frame.points.size() != static_cast<std::size_t>(frame.width) *
                                   static_cast<std::size_t>(frame.height))
      throw std::invalid_argument("a frame has not width * height points");
  }
}

} // namespace

std::string
validityError(const NoiseCalibrationOptions& options)
{
  const auto isPositive = [](double x) { return std::isfinite(x) && x > 0.0; };
  if (!isPositive(options.baseline_m) || !isPositive(options.focal_px))
    return "baseline_m and focal_px must be positive numbers";
  if (!isPositive(options.camera.fx) || !isPositive(options.camera.fy))
    return "camera.fx and camera.fy must be positive numbers";
  if (options.region_px < 0 || options.region_px % kTileSize != 0)
    return "region_px must be 0 or a multiple of " + std::to_string(kTileSize);
  return "";
}

NoiseCalibration
calibrateNoise(const std::vector<PointImage>& frames,
               const NoiseCalibrationOptions& options)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument(error);
  requireSameSizes(frames);
  NoiseCalibration result;
  result.frames = static_cast<int>(frames.size());

  const DisparityStack stack(frames, options);
  const TileImage image = stack.tiles(frames, options);
  if (std::none_of(image.tiles.begin(), image.tiles.end(), [](const Tile& tile) {
        return tile.usable;
      }))
    return result;

  const FlatRegions flat = findFlatRegions(image, options);
  result.region_px = flat.are_planes ? options.region_px : kTileSize;
  const std::vector<Region> regions = cutRegions(flat, image, result.region_px);
  result.status = regions.empty() ? NoiseCalibrationStatus::NothingFlat :
                                    NoiseCalibrationStatus::Ok;
  if (regions.empty())
    return result;

  const std::vector<int> cells = cellsOf(image);
  const std::vector<TileSums> tiles = sumsOf(image, regions);
  const std::vector<CellSums> sums = byCell(tiles, cells);
  result.planes = flat.are_planes ? static_cast<int>(flat.regions.size()) : 0;
  result.sigmas = sigmasOf(sums);
  result.fixed_from_difference = rootOf(jackknife(sums, [](const Eigen::ArrayXd& s) {
    return singleVariance(s) - temporalVariance(s);
  }));
  result.sigma_point = scatterAcrossRays(sums);
  result.quantum =
      findQuantum(stack, image, regions, cells, options.focal_px * options.baseline_m);
  if (result.quantum.isKnown())
    result.before_rounding = unrounded(sums, result.quantum.value);
  result.by_region_size = byRegionSize(image, flat, cells);
  result.by_depth = byDepth(image, tiles, cells);
  result.depth_exponent = jackknife(sums, depthExponent);
  result.min_m = result.by_depth.front().min_m;
  result.max_m = result.by_depth.back().max_m;
  for (const DepthRow& row : result.by_depth) {
    result.mean_m += row.pixels * row.mean_m;
    result.pixels += row.pixels;
  }
  result.mean_m /= result.pixels;
  return result;
}

/// With Q1 - Q2 = k q for the difference delta = (k + f) q of the values before
/// rounding, 0 <= f < 1, with probability 1 - f over the position between two steps,
/// and (k + 1) q with probability f,
///
///   E (Q1 - Q2)^2 = q^2 ((1 - f) k^2 + f (k + 1)^2) = delta^2 + q^2 f (1 - f).
///
/// f (1 - f) = 1/6 - sum_m cos(2 pi m f) / (pi m)^2, m = 1, 2, ..., and delta is normal
/// with variance 2 sigma^2, for which E cos(2 pi m delta / q) =
/// exp(-4 pi^2 m^2 sigma^2 / q^2). Together:
///
///   E (Q1 - Q2)^2 / 2 = sigma^2 + q^2 / 12
///                       - q^2 / (2 pi^2) sum_m exp(-(2 pi m sigma / q)^2) / m^2.
double
roundedTemporalVariance(double sigma_px, double quantum_px)
{
  const double ratio = sigma_px / quantum_px;
  // Below, the series is slow, and all that happens is a single step now and then:
  // f = |delta| / q is small, E (Q1 - Q2)^2 = q E |delta|, exactly but for
  // exp(-1 / (4 ratio^2)).
  if (ratio < 0.1)
    return quantum_px * sigma_px / std::sqrt(kPi);
  double sum = 0.0;
  for (int m = 1;; ++m) {
    const double term = std::exp(-std::pow(2.0 * kPi * m * ratio, 2)) / (m * m);
    sum += term;
    if (term < 1e-17)
      break;
  }
  return sigma_px * sigma_px +
         quantum_px * quantum_px * (1.0 / 12.0 - sum / (2.0 * kPi * kPi));
}

double
sigmaBeforeRounding(double variance_px2, double quantum_px)
{
  if (variance_px2 <= 0.0)
    return 0.0;
  if (!std::isfinite(variance_px2))
    return variance_px2;
  // Rounding only adds variance, and the sum grows with sigma.
  double low = 0.0, high = std::sqrt(variance_px2);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (roundedTemporalVariance(middle, quantum_px) < variance_px2 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

} // namespace holdfast
