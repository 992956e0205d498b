#include "contrasts.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <limits>

namespace holdfast {
namespace {

std::vector<ContrastStep>
makeSteps()
{
  std::vector<ContrastStep> steps;
  for (const int k : {1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 19, 24, 30, 38, 48, 60, 75})
    steps.push_back({k, false});
  for (const int k : {1, 2, 3, 4, 6, 8, 11, 15, 21, 30, 42, 52})
    steps.push_back({k, true});
  std::sort(steps.begin(),
            steps.end(),
            [](const ContrastStep& a, const ContrastStep& b) {
              return a.distance() < b.distance();
            });
  return steps;
}

/// NaN where one of the three is missing.
double
contrast(const std::vector<float>& image, std::size_t middle, std::size_t offset)
{
  const double before = image[middle - offset], here = image[middle];
  const double after = image[middle + offset];
  return before - 2.0 * here + after;
}

bool
onOnePlane(const PlaneImages& pose, std::size_t middle, std::size_t offset)
{
  const std::int16_t plane = pose.plane[middle];
  return plane > 0 && pose.plane[middle - offset] == plane &&
         pose.plane[middle + offset] == plane;
}

void
addFrames(const PlaneImages& pose, std::size_t middle, std::size_t offset, double* sums)
{
  double before = std::numeric_limits<double>::quiet_NaN();
  for (const std::vector<float>& frame : pose.frames) {
    const double now = contrast(frame, middle, offset);
    if (!std::isnan(now)) {
      sums[WithinFrame] += now * now;
      sums[WithinFrames] += 1.0;
    }
    if (const double change = now - before; !std::isnan(change)) {
      sums[BetweenFrames] += 0.5 * change * change;
      sums[BetweenFrameCount] += 1.0;
    }
    before = now;
  }
}

/// Adds one triple of pixels: every pose in which it lies on a plane, and every pair of
/// such poses, whose products are half of (square of the sum - sum of the squares).
void
addTriple(const std::vector<PlaneImages>& poses,
          std::size_t middle,
          std::size_t offset,
          double* sums)
{
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (const PlaneImages& pose : poses) {
    if (!onOnePlane(pose, middle, offset))
      continue;
    addFrames(pose, middle, offset, sums);
    const double mean = contrast(pose.mean, middle, offset);
    if (std::isnan(mean))
      continue;
    sum += mean;
    squares += mean * mean;
    count += 1.0;
  }
  sums[BetweenPoses] += 0.5 * (sum * sum - squares);
  sums[BetweenPoseCount] += 0.5 * count * (count - 1.0);
}

/// All triples in one direction.
void
addDirection(const std::vector<PlaneImages>& poses,
             int du,
             int dv,
             std::size_t step,
             std::vector<CellSums>& cells)
{
  const int width = poses.front().width, height = poses.front().height;
  const int margin = std::abs(dv);
  // Upwards to the right, the offset of the rows counts backwards: either end is first.
  const auto offset = static_cast<std::size_t>(std::abs(dv * width + du));
  for (int v = margin; v < height - margin; ++v)
    for (int u = std::abs(du); u < width - std::abs(du); ++u) {
      const auto i = static_cast<std::size_t>(v * width + u);
      CellSums& cell = cells[poses.front().cell[i]];
      addTriple(poses,
                i,
                offset,
                cell.sums.data() + static_cast<std::ptrdiff_t>(step) * kContrastSums);
    }
}

float
meanOf(const std::vector<std::vector<float>>& frames, std::size_t i)
{
  double sum = 0.0;
  int count = 0;
  for (const std::vector<float>& frame : frames)
    if (std::isfinite(frame[i])) {
      sum += static_cast<double>(frame[i]);
      ++count;
    }
  return count > 0 ? static_cast<float>(sum / count) : kUnknownDisparity;
}

void
markCells(const TileImage& tiles, PlaneImages& images)
{
  for (int v = 0; v < images.height; ++v)
    for (int u = 0; u < images.width; ++u) {
      const int column = std::min(u / kTileSize, tiles.columns - 1);
      const int row = std::min(v / kTileSize, tiles.rows - 1);
      images.cell.push_back(
          static_cast<std::uint8_t>(tiles.patternCellOf(tiles.index(column, row))));
    }
}

} // namespace

const std::vector<ContrastStep>&
contrastSteps()
{
  static const std::vector<ContrastStep> steps = makeSteps();
  return steps;
}

PlaneImages
planeImages(const DisparityStack& stack,
            const TileImage& tiles,
            const std::vector<Region>& planes)
{
  PlaneImages images;
  images.width = stack.width();
  images.height = stack.height();
  const auto pixels = static_cast<std::size_t>(images.width * images.height);
  images.plane.assign(pixels, 0);
  images.frames.assign(static_cast<std::size_t>(stack.frames()),
                       std::vector<float>(pixels, kUnknownDisparity));
  images.mean.assign(pixels, kUnknownDisparity);
  std::int16_t number = 0;
  for (const Region& plane : planes) {
    ++number;
    for (const int tile : plane)
      for (int k = 0; k < kTileSize * kTileSize; ++k) {
        const int u = tile % tiles.columns * kTileSize + k % kTileSize;
        const int v = tile / tiles.columns * kTileSize + k / kTileSize;
        const auto i = static_cast<std::size_t>(v * images.width + u);
        images.plane[i] = number;
        for (std::size_t t = 0; t < images.frames.size(); ++t)
          images.frames[t][i] = stack.disparity(static_cast<int>(t), u, v);
        images.mean[i] = meanOf(images.frames, i);
      }
  }
  markCells(tiles, images);
  return images;
}

std::vector<CellSums>
contrastSums(const std::vector<PlaneImages>& poses)
{
  const std::vector<ContrastStep>& steps = contrastSteps();
  const auto length = static_cast<Eigen::Index>(steps.size()) * kContrastSums;
  std::vector<CellSums> cells(kPatternColumns * kPatternRows,
                              {0.0, Eigen::ArrayXd::Zero(length)});
  for (std::size_t s = 0; s < steps.size(); ++s) {
    const int k = steps[s].pixels;
    addDirection(poses, k, steps[s].diagonal ? k : 0, s, cells);
    addDirection(poses, steps[s].diagonal ? -k : 0, k, s, cells);
  }
  for (CellSums& cell : cells)
    cell.weight = cell.sums[WithinFrames];
  return cells;
}

} // namespace holdfast
