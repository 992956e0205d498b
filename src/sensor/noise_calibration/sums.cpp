#include "sums.h"

#include <cmath>

namespace holdfast {
namespace {

TileSums
withoutResiduals(const TileImage& image, int index)
{
  const Tile& tile = image[index];
  TileSums result;
  result.cell = image.cellOf(index);
  result.depth_m = tile.depth_m;
  result.sums = Eigen::ArrayXd::Zero(kSums);
  result.sums[Temporal] = tile.temporal;
  result.sums[TemporalDof] = tile.temporal_dof;
  result.sums[Pixels] = tile.mean.count;
  result.sums[InverseCounts] = tile.inverse_counts;
  result.sums[Scatter] = tile.scatter;
  result.sums[ScatterDof] = tile.scatter_dof;
  return result;
}

/// Squared residuals to the plane of a region and their degrees of freedom. The plane
/// takes three, which the tiles of the region share.
struct Residuals {
  double squares;
  double dof;

  Residuals(const PlaneMoments& tile, const PlaneMoments& region)
  : squares(tile.residual(region.plane())), dof(tile.count * (1.0 - 3.0 / region.count))
  {}
};

void
addFrame(const Residuals& residuals, TileSums& tile)
{
  const double log_depth = std::log(tile.depth_m);
  tile.weight += residuals.dof;
  tile.sums[Single] += residuals.squares;
  tile.sums[SingleDof] += residuals.dof;
  tile.sums[LogDepth] += residuals.dof * log_depth;
  tile.sums[LogDepth2] += residuals.dof * log_depth * log_depth;
  tile.sums[SingleLogDepth] += residuals.squares * log_depth;
}

void
addMean(const Residuals& residuals, TileSums& tile)
{
  tile.sums[Mean] += residuals.squares;
  tile.sums[MeanDof] += residuals.dof;
}

void
append(const TileImage& image, const Region& region, std::vector<TileSums>& all)
{
  PlaneMoments mean;
  std::vector<PlaneMoments> frames(image.tiles.front().frames.size());
  for (const int i : region) {
    mean += image[i].mean;
    for (std::size_t t = 0; t < frames.size(); ++t)
      frames[t] += image[i].frames[t];
  }
  for (const int i : region) {
    TileSums& tile = all.emplace_back(withoutResiduals(image, i));
    addMean({image[i].mean, mean}, tile);
    // A frame in which something stood before most of the region says little about it.
    for (std::size_t t = 0; t < frames.size(); ++t)
      if (frames[t].hasPlane() && frames[t].count > 0.5 * mean.count)
        addFrame({image[i].frames[t], frames[t]}, tile);
  }
}

} // namespace

std::vector<TileSums>
sumsOf(const TileImage& image, const std::vector<Region>& regions)
{
  std::vector<TileSums> all;
  for (const Region& region : regions)
    append(image, region, all);
  return all;
}

std::vector<CellSums>
byCell(const std::vector<TileSums>& tiles)
{
  std::vector<CellSums> cells(kCellColumns * kCellRows,
                              {0.0, Eigen::ArrayXd::Zero(kSums)});
  for (const TileSums& tile : tiles) {
    CellSums& cell = cells[static_cast<std::size_t>(tile.cell)];
    cell.weight += tile.weight;
    cell.sums += tile.sums;
  }
  return cells;
}

} // namespace holdfast
