/// \file Flat parts of a scene, found without being told where.
#pragma once

#include "tiles.h"

#include <vector>

namespace holdfast {

/// Indices of tiles.
using Region = std::vector<int>;

struct FlatRegions {
  bool are_planes = false; ///< else flat spots of curved surfaces
  std::vector<Region> regions;
};

/// Planes of at least 48 x 48 pixels, with holes and any outline. Where there are none,
/// spots of 32 x 32 pixels, to be cut into tiles: curvature goes with the fourth power
/// of the size, so that what adds a tenth to the variance about the plane of a spot
/// adds 1/256 of that to its tiles. So does a fixed pattern, and a sensor with one has
/// planes or nothing.
FlatRegions findFlatRegions(const TileImage& image,
                            const NoiseCalibrationOptions& options);

/// The regions cut by a square grid; pieces that fill less than half a square are left
/// out.
/// \param size_px multiple of kTileSize; 0: the regions themselves.
std::vector<Region> cutRegions(const FlatRegions& flat,
                               const TileImage& image,
                               int size_px);

} // namespace holdfast
