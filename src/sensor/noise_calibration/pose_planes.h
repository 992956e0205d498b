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

/// The same frames with less noise on planes that were found before.
PosePlanes onPlanes(const PoseFrames& pose,
                    const std::vector<Region>& planes,
                    const NoiseCalibrationOptions& options);

/// What calibratePattern() finds on the planes of all poses, each of them Ok.
PatternCalibration patternOn(std::vector<PosePlanes> poses);

/// \throw std::invalid_argument when there is no pose, one has no frame, or their sizes
/// differ.
void requireSameSizes(const std::vector<PoseFrames>& poses);

} // namespace holdfast
