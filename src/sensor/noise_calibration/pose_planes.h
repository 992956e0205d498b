/// \file The planes that a calibration sees from one place.
#pragma once

#include "contrasts.h"
#include "regions.h"
#include "tiles.h"

#include <holdfast/sensor/pattern_calibration.h>

#include <vector>

namespace holdfast {

struct PosePlanes {
  NoiseCalibrationStatus status = NoiseCalibrationStatus::Ok;
  TileImage tiles;
  std::vector<Region> regions; ///< empty unless Ok
  PlaneImages images; ///< the same
};

/// Flat spots of curved surfaces are no planes.
PosePlanes findPosePlanes(const PoseFrames& pose,
                          const NoiseCalibrationOptions& options);

/// \throw std::invalid_argument when there is no pose, one has no frame, or their sizes
/// differ.
void requireSameSizes(const std::vector<PoseFrames>& poses);

} // namespace holdfast
