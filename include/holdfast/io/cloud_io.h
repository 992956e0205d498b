/// \file Clouds from and to files.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/camera.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// What only depth images need; other formats carry metres.
struct LoadOptions {
  double depth_scale = 1000.0; ///< pixel units per metre: 1000 for mm, 5000 for TUM
  /// Camera that took the depth image. Its intrinsics are scaled to the size of an
  /// image of the same aspect ratio.
  Camera camera;
  /// Depths the sensor can deliver, m. An image without any of them is an error, since
  /// its depth scale must be wrong; single depths outside are kept.
  double min_range_m = 0.0;
  double max_range_m = std::numeric_limits<double>::infinity();
};

/// What a file said about its cloud.
struct CloudFileInfo {
  std::string format; ///< "PCD ascii", "PLY binary_little_endian", "PNG depth", ...
  std::vector<std::string> fields; ///< names in the order of the file
  std::optional<Pose> viewpoint; ///< the file's own sensor pose, if it has one
  std::vector<std::string> notices; ///< one line each: what the reader had to decide
};

/// Reads PCD (ascii, binary, binary_compressed), PLY (ascii, binary, any number type)
/// and 16-bit depth images (gray PNG, binary PGM); the content decides, then the
/// extension.
///
/// PCD and depth images keep their grid; PLY clouds are unorganized. A PCD field
/// `covariance` of six floats (xx xy xz yy yz zz, m^2) becomes the covariances of the
/// cloud, unchecked (countInvalidCovariances). The sensor pose comes from VIEWPOINT, or
/// from the camera element of a PLY, unless the points contradict it
/// (chooseSensorPose); else it is the identity.
/// \throw std::runtime_error "FILE: cause" when the file is missing, no regular file,
/// empty, truncated, corrupt, without x, y and z or without one finite point.
/// \throw std::invalid_argument when depth_scale is not a positive number.
RangeCloud loadCloud(const std::string& path,
                     const LoadOptions& options = {},
                     CloudFileInfo* info = nullptr);

/// Writes a PCD with the sensor pose as VIEWPOINT and, when there are any, the
/// covariances as the field `covariance`. Text keeps 9 digits, so floats survive it.
/// \throw std::runtime_error when the file cannot be written; then there is none, or
/// the one from before.
void saveCloud(const std::string& path, const RangeCloud& cloud, bool ascii = false);

/// True for a file that loadCloud() is meant for: by its extension, and for PNG images
/// by 16 bits of gray. Our own results (NAME.patches.pcd and .ply) are none.
bool isCloudFile(const std::string& path);

/// How many points are finite.
int countValidPoints(const RangeCloud& cloud);

/// How many finite points have a covariance that is not finite or not positive
/// semi-definite.
int countInvalidCovariances(const RangeCloud& cloud);

} // namespace holdfast
