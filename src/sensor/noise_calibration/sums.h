/// \file What the tiles of flat regions add to the estimates.
#pragma once

#include "jackknife.h"
#include "regions.h"

namespace holdfast {

/// Indices of CellSums::sums.
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

struct TileSums : CellSums {
  int cell = 0;
  double depth_m = 0.0;
};

/// Of the tiles of all regions, with residuals to the planes of their regions.
std::vector<TileSums> sumsOf(const TileImage& image,
                             const std::vector<Region>& regions);

/// All cells, also those without tiles.
std::vector<CellSums> byCell(const std::vector<TileSums>& tiles);

} // namespace holdfast
