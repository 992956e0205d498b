#include "tiles.h"

#include <algorithm>

namespace holdfast {
namespace {

// A value that is as many typical changes away from the median of its pixel saw
// something else: many, since the noise may grow with the range.
constexpr float kMovedChanges = 10.0F;

// What transforming and storing the points changes of a disparity.
constexpr float kSinglePrecision = 1e-6F;

constexpr double kLeastTileShare = 0.75; // of its pixels

// Tiles that are noisier than those around them in depth contain an edge, a flickering
// highlight or something that moves. The variance of 64 independent pixels scatters by
// 18 %, so that no other tile comes near.
constexpr double kLargestVarianceRatio = 4.0;
constexpr std::ptrdiff_t kNeighborsInDepth = 25; // on either side

template <typename Number>
Number
medianOf(std::vector<Number>& values)
{
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Marks usable tiles whose variance is out of proportion as not usable.
template <typename Variance>
void
dropUntypical(std::vector<Tile>& tiles, Variance&& variance)
{
  std::vector<Tile*> by_depth;
  for (Tile& tile : tiles)
    if (tile.usable)
      by_depth.push_back(&tile);
  std::stable_sort(by_depth.begin(), by_depth.end(), [](const Tile* a, const Tile* b) {
    return a->depth_m < b->depth_m;
  });
  std::vector<double> variances;
  for (const Tile* tile : by_depth)
    variances.push_back(variance(*tile));
  const auto n = static_cast<std::ptrdiff_t>(by_depth.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    std::vector<double> window(
        variances.begin() + std::max<std::ptrdiff_t>(0, i - kNeighborsInDepth),
        variances.begin() + std::min(n, i + kNeighborsInDepth + 1));
    const double median = medianOf(window);
    const auto k = static_cast<std::size_t>(i);
    // Without noise, and within a step of the disparity, most tiles have no variance.
    if (median > 0.0 && variances[k] > kLargestVarianceRatio * median)
      by_depth[k]->usable = false;
  }
}

} // namespace

DisparityStack::DisparityStack(const std::vector<PointImage>& frames,
                               const NoiseCalibrationOptions& options)
: width_(frames.front().width), height_(frames.front().height)
{
  const double fb = options.focal_px * options.baseline_m;
  for (const PointImage& frame : frames) {
    std::vector<float>& disparities = frames_.emplace_back();
    disparities.reserve(frame.points.size());
    for (const Eigen::Vector3f& q : frame.points)
      disparities.push_back(q.allFinite() && q.z() > 0.0F ?
                                static_cast<float>(fb / q.z()) :
                                kUnknownDisparity);
  }
  if (this->frames() > 1)
    dropWhatMoved();
}

DisparityStack::Spread
DisparityStack::spreadOf(int u, int v) const
{
  Spread spread;
  for (int t = 0; t < frames(); ++t) {
    const double d = disparity(t, u, v);
    if (!std::isfinite(d))
      continue;
    const double step = d - spread.mean;
    spread.mean += step / ++spread.count;
    spread.squares += step * (d - spread.mean);
  }
  return spread;
}

/// From frame to frame, px: the median over tiles of the median change in a tile, which
/// is one sigma of the noise, or the step of the disparities where that is wider. No
/// change does not count: under wide steps, most pixels keep their value. Infinite when
/// nothing changes.
float
DisparityStack::typicalChange() const
{
  std::vector<float> tiles, changes;
  for (int row = 0; row + kTileSize <= height_; row += kTileSize)
    for (int column = 0; column + kTileSize <= width_; column += kTileSize) {
      changes.clear();
      for (int t = 1; t < frames(); ++t)
        for (int k = 0; k < kTileSize * kTileSize; ++k) {
          const int u = column + k % kTileSize, v = row + k / kTileSize;
          const float d = disparity(t, u, v);
          const float change = std::abs(d - disparity(t - 1, u, v));
          if (change > kSinglePrecision * d) // not for NaN
            changes.push_back(change);
        }
      if (!changes.empty())
        tiles.push_back(medianOf(changes));
    }
  return tiles.empty() ? std::numeric_limits<float>::infinity() : medianOf(tiles);
}

void
DisparityStack::dropWhatMoved()
{
  const float limit = kMovedChanges * typicalChange();
  std::vector<float> values;
  for (std::size_t i = 0; i < frames_.front().size(); ++i) {
    values.clear();
    for (const auto& frame : frames_)
      if (std::isfinite(frame[i]))
        values.push_back(frame[i]);
    const float median = values.empty() ? kUnknownDisparity : medianOf(values);
    std::size_t kept = 0;
    for (auto& frame : frames_) {
      if (!(std::abs(frame[i] - median) <= limit))
        frame[i] = kUnknownDisparity;
      kept += std::isfinite(frame[i]);
    }
    if (kept < 2 || 2 * kept < frames_.size())
      for (auto& frame : frames_)
        frame[i] = kUnknownDisparity;
  }
}

void
DisparityStack::addPixel(int u, int v, Tile& tile) const
{
  const Spread pixel = spreadOf(u, v);
  if (pixel.count == 0)
    return;
  for (int t = 0; t < frames(); ++t)
    if (const double d = disparity(t, u, v); std::isfinite(d))
      tile.frames[static_cast<std::size_t>(t)].add(u, v, d);
  tile.mean.add(u, v, pixel.mean);
  tile.inverse_counts += 1.0 / pixel.count;
  tile.temporal += pixel.squares;
  tile.temporal_dof += pixel.count - 1;
}

/// The ray grid is affine in the pixels, x/z = (u - cx) / fx, and a tile finds its own:
/// neither the principal point nor a smooth distortion of the lens is scatter.
void
DisparityStack::addScatter(const PointImage& image,
                           int column,
                           int row,
                           double focal_px,
                           Tile& tile) const
{
  PlaneMoments columns, rows;
  for (int v = row; v < row + kTileSize; ++v)
    for (int u = column; u < column + kTileSize; ++u) {
      const auto i = static_cast<std::size_t>(v * width_ + u);
      const Eigen::Vector3d q = image.points[i].cast<double>();
      if (!q.allFinite() || !(q.z() > 0.0))
        continue;
      columns.add(u, v, focal_px * q.x() / q.z());
      rows.add(u, v, focal_px * q.y() / q.z());
    }
  for (const PlaneMoments* moments : {&columns, &rows})
    if (moments->hasPlane()) {
      tile.scatter += moments->residual(moments->plane());
      tile.scatter_dof += moments->count - 3.0;
    }
}

TileImage
DisparityStack::tiles(const std::vector<PointImage>& frames,
                      const NoiseCalibrationOptions& options) const
{
  TileImage image;
  image.columns = width_ / kTileSize;
  image.rows = height_ / kTileSize;
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.columns; ++column) {
      Tile& tile = image.tiles.emplace_back();
      tile.frames.resize(frames_.size());
      const int u0 = column * kTileSize, v0 = row * kTileSize;
      for (int v = v0; v < v0 + kTileSize; ++v)
        for (int u = u0; u < u0 + kTileSize; ++u)
          addPixel(u, v, tile);
      tile.usable = tile.mean.hasPlane() &&
                    tile.mean.count >= kLeastTileShare * kTileSize * kTileSize;
      if (!tile.usable)
        continue;
      tile.depth_m = options.focal_px * options.baseline_m / tile.mean.mean.z();
      for (const PointImage& frame : frames)
        addScatter(frame, u0, v0, options.focal_px, tile);
    }
  dropUntypical(image.tiles, [](const Tile& tile) { return tile.mean.variance(); });
  if (this->frames() > 1)
    dropUntypical(image.tiles,
                  [](const Tile& tile) { return tile.temporal / tile.temporal_dof; });
  return image;
}

} // namespace holdfast
