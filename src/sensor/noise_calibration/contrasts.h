/// \file Second differences of disparities on planes.
#pragma once

#include "jackknife.h"
#include "regions.h"
#include "tiles.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace holdfast {

/// Second differences over so many columns, rows, or both.
struct ContrastStep {
  int pixels = 1;
  bool diagonal = false;

  double distance() const
  {
    return diagonal ? pixels * std::sqrt(2.0) : pixels;
  }
};

/// By distance, to 75 px: with twice that, C() is asked for up to 150 px.
const std::vector<ContrastStep>& contrastSteps();

/// Indices of the sums of a step.
enum ContrastSum {
  WithinFrame, ///< squares, px^2
  WithinFrames, ///< their number
  BetweenFrames, ///< half the squares of the changes from frame to frame
  BetweenFrameCount,
  BetweenPoses, ///< products of the means of two poses
  BetweenPoseCount,
  kContrastSums
};

/// What one pose shows on its planes.
struct PlaneImages {
  int width = 0;
  int height = 0;
  std::vector<std::int16_t> plane; ///< number of a pixel's plane, from 1; 0: none
  std::vector<std::vector<float>> frames; ///< disparities, px; NaN: none
  std::vector<float> mean; ///< over the frames
  std::vector<std::uint8_t> cell; ///< of the jackknife
};

PlaneImages planeImages(const DisparityStack& stack,
                        const TileImage& tiles,
                        const std::vector<Region>& planes);

/// Sums of all steps, one after the other, by cell of the middle pixel.
std::vector<CellSums> contrastSums(const std::vector<PlaneImages>& poses);

} // namespace holdfast
