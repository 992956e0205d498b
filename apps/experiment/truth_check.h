/// \file Patches of a simulated frame against the surface that was there.
#pragma once

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/simulation/simulator.h>

#include <vector>

namespace holdfast::app {

struct TruthTally {
  int patches = 0;
  int over_edge = 0; ///< of them leave the true surface
  int smooth_pixels = 0; ///< looked at
  int covered_pixels = 0; ///< of them lie on a patch
};

TruthTally& operator+=(TruthTally& all, const TruthTally& one);

/// A patch leaves the true surface when in more than a twentieth of the pixels that see
/// it, the point that was really there is more than four sigmas of a measured point
/// away from it, along its normal. The surface is smooth at a pixel, of which every
/// eighth is looked at, when the noise-free points of the neighbourhood there fill its
/// disc by nine tenths and leave a patch by less than half a sigma (root mean square).
TruthTally compareWithTruth(const RangeImage& image,
                            const Sensor& sensor,
                            const std::vector<ExtractedPatch>& patches,
                            double radius_m);

} // namespace holdfast::app
