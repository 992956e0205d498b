#include <holdfast/sensor/noise_calibration.h>

#include "noise_calibration/frames.h"
#include "noise_calibration/step.h"
#include "noise_calibration/sums.h"

#include <algorithm>
#include <stdexcept>

namespace holdfast {
namespace {

constexpr int kRegionSizes[] = {8, 16, 32, 64, 128, 0}; // px; 0: whole planes

// Single precision of the points scatters them by 1e-4 px.
constexpr double kOnTheGridPx = 0.01;

// Standard deviation of log depth: with less, an exponent would mean nothing.
constexpr double kLeastDepthSpread = 0.02;

constexpr std::size_t kDepthRows = 6;
constexpr std::size_t kLeastTilesInRow = 40;

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

/// Whether the disparities of the surfaces spread so far that any position between two
/// steps is as likely as any other. Those of a wall seen from the front need not.
bool
crossesSteps(const TileImage& image, const std::vector<Region>& regions, double quantum)
{
  PlaneMoments all;
  for (const Region& region : regions)
    for (const int i : region)
      all += image[i].mean;
  return all.scatter(2, 2) > all.count * quantum * quantum;
}

/// Where the surfaces cross many steps, the rounding error is uniform and independent
/// of the noise, however small that is, and adds q^2 / 12 to the residual. Two frames
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
  const double n = s[SingleDof], mean = s[LogDepth] / n;
  const double spread = s[LogDepth2] / n - mean * mean;
  if (!(spread > kLeastDepthSpread * kLeastDepthSpread))
    return std::numeric_limits<double>::quiet_NaN();
  const double beta = (s[SingleLogDepth] - s[Single] * mean) / (n * spread);
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

DepthRow
depthRow(const std::vector<TileSums>& tiles)
{
  DepthRow row;
  row.min_m = tiles.front().depth_m;
  row.max_m = tiles.back().depth_m;
  double pixels = 0.0;
  for (const TileSums& tile : tiles) {
    pixels += tile.sums[Pixels];
    row.mean_m += tile.sums[Pixels] * tile.depth_m;
  }
  row.mean_m /= pixels;
  row.pixels = static_cast<int>(pixels);
  row.sigmas = sigmasOf(byCell(tiles));
  return row;
}

/// Rows of about as many tiles each.
std::vector<DepthRow>
byDepth(std::vector<TileSums> tiles)
{
  std::stable_sort(
      tiles.begin(),
      tiles.end(),
      [](const TileSums& a, const TileSums& b) { return a.depth_m < b.depth_m; });
  const std::size_t count =
      std::clamp<std::size_t>(tiles.size() / kLeastTilesInRow, 1, kDepthRows);
  const auto at = [&](std::size_t k) {
    return tiles.begin() + static_cast<std::ptrdiff_t>(k * tiles.size() / count);
  };
  std::vector<DepthRow> rows;
  for (std::size_t k = 0; k < count; ++k)
    rows.push_back(depthRow({at(k), at(k + 1)}));
  return rows;
}

std::vector<RegionSizeRow>
byRegionSize(const TileImage& image, const FlatRegions& flat)
{
  std::vector<RegionSizeRow> rows;
  for (const int size : kRegionSizes) {
    // Within small spots only small tiles are known to be flat.
    if (!flat.are_planes && size != kTileSize)
      continue;
    const std::vector<Region> regions = cutRegions(flat, image, size);
    const Estimate single =
        rootOf(jackknife(byCell(sumsOf(image, regions)), singleVariance));
    if (single.isKnown())
      rows.push_back({size, static_cast<int>(regions.size()), single});
  }
  return rows;
}

void
addDepths(const std::vector<TileSums>& tiles, NoiseCalibration& result)
{
  result.by_depth = byDepth(tiles);
  result.min_m = result.by_depth.front().min_m;
  result.max_m = result.by_depth.back().max_m;
  for (const DepthRow& row : result.by_depth) {
    result.mean_m += row.pixels * row.mean_m;
    result.pixels += row.pixels;
  }
  result.mean_m /= result.pixels;
}

void
addSigmas(const std::vector<CellSums>& cells, NoiseCalibration& result)
{
  result.sigmas = sigmasOf(cells);
  result.fixed_from_difference = rootOf(jackknife(cells, [](const Eigen::ArrayXd& s) {
    return singleVariance(s) - temporalVariance(s);
  }));
  result.sigma_point = scatterAcrossRays(cells);
  result.depth_exponent = jackknife(cells, depthExponent);
}

} // namespace

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

  result.status = NoiseCalibrationStatus::NothingFlat;
  const FlatRegions flat = findFlatRegions(image, options);
  result.region_px = flat.are_planes ? options.region_px : kTileSize;
  const std::vector<Region> regions = cutRegions(flat, image, result.region_px);
  if (regions.empty())
    return result;

  result.status = NoiseCalibrationStatus::Ok;
  result.planes = flat.are_planes ? static_cast<int>(flat.regions.size()) : 0;
  const std::vector<TileSums> tiles = sumsOf(image, regions);
  const std::vector<CellSums> cells = byCell(tiles);
  addSigmas(cells, result);
  addDepths(tiles, result);
  result.by_region_size = byRegionSize(image, flat);
  result.quantum =
      findQuantum(stack, image, regions, options.focal_px * options.baseline_m);
  if (crossesSteps(image, regions, result.quantum.value)) // not for NaN
    result.before_rounding = unrounded(cells, result.quantum.value);
  return result;
}

} // namespace holdfast
