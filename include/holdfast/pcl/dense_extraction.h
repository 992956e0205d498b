/// \file Patches all over an image, a fixed number of pixels apart.
#pragma once

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/pcl/point_types.h>

#include <pcl/point_cloud.h>

#include <string>

namespace holdfast {

/// An image of attempts at patches.
struct DenseExtraction {
  int stride = 0; ///< px of the cloud, across and down, from one attempt to the next
  int width = 0;
  int height = 0;
  /// One attempt for each place, row by row, failed and turned down ones among them
  /// (isAccepted()): that of column i and row j is at the pixel (i stride + stride / 2,
  /// j stride + stride / 2), which `seed_index` names. An attempt takes two kilobytes.
  ExtractionResult result;
};

/// Empty when an image of that cloud can be made, else one sentence: the cloud is not
/// organized, the stride below 1 or so large that no pixel is left, or the options
/// limit the number of patches, their area, time, or overlap.
std::string validityError(const RangeCloud& cloud,
                          const ExtractionOptions& options,
                          int stride);

/// Fits a patch around every stride-th pixel of an organized cloud: the same, bit for
/// bit, as extractPatches() with those seeds. Seed strategy and spacing do not apply.
/// \param former whose memory is used again, as for extractPatches().
/// \throw std::invalid_argument with the validityError(), and as extractPatches().
DenseExtraction extractDense(const RangeCloud& cloud,
                             const Sensor& sensor,
                             const ExtractionOptions& options,
                             int stride,
                             DenseExtraction former = {});

/// The attempts as an organized cloud in the frame they are in; NaN, with its status,
/// where there is no patch (toPatchPoint()).
pcl::PointCloud<PatchPoint> toPatchCloud(const DenseExtraction& dense,
                                         const Pose& sensor_pose);

} // namespace holdfast
