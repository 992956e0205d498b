/// \file Patches of a stream of frames.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <vector>

namespace holdfast {

/// Extracts patches from one organized frame after another, each within the limits of
/// options.sampler (max_patches, max_time_s), so that a stream never falls behind.
///
/// Seeds are always the same pixels: a uniform grid of max_seeds of them or, if that is
/// 0, of three for every patch wanted. They have their turns in this order: those whose
/// patch was accepted in the frame before, those that had no turn, those that failed.
/// So what was good stays, while the scene does, and the number of patches is steady;
/// what time is left finds new ones. At first, and among equals, the order is random
/// (options.sampler.random_seed), so that few seeds span the image, too.
class FrameExtractor {
public:
  /// \throw std::invalid_argument when neither max_seeds nor max_patches is set, or a
  /// sampler option makes no sense.
  FrameExtractor(const Sensor& sensor, const ExtractionOptions& options);

  /// Patches of the next frame; those of the old seeds come first. Without max_time_s
  /// the result depends on the frames so far alone. A frame of another size starts
  /// anew.
  /// \param former as for extractPatches(): of the last frame, so that none takes
  ///        memory for its patches.
  /// \throw std::invalid_argument when the cloud is not organized, and as
  /// extractPatches().
  ExtractionResult extract(const RangeCloud& frame, ExtractionResult former = {});

private:
  void restart(int width, int height);

  Sensor sensor_;
  ExtractionOptions options_;
  int width_ = 0;
  int height_ = 0;
  std::vector<int> seeds_; ///< pixel indices in the order of their turns
};

} // namespace holdfast
