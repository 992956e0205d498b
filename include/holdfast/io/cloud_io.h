/// \file Clouds from and to files.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/camera.h>

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// Which way the axes of the sensor's frame point.
enum class CloudAxes {
  Camera, ///< x right, y down, z forward: Holdfast, PCL, OpenCV
  OpenGl, ///< x right, y up, z back
  Ros ///< x forward, y left, z up
};

/// The rotation T with q_axes = T q_camera, camera axes x right, y down, z forward.
Eigen::Matrix3d turnFromCamera(CloudAxes axes);

/// What a file does not say about its cloud. Whatever the axes and the unit of the
/// file, the cloud comes out in the file's frame and in metres: the axes turn the
/// sensor, not the points.
struct LoadOptions {
  double depth_scale = 1000.0; ///< pixel units per metre: 1000 for mm, 5000 for TUM
  /// The caller knows the depth scale: what speaks against it is a notice, no error.
  bool depth_scale_given = false;
  /// Camera that took the depth image. Its intrinsics are scaled to the size of an
  /// image of the same aspect ratio.
  Camera camera;
  /// fx, fy, cx and cy of `camera` are those of this very image, whatever its size.
  bool camera_given = false;
  std::string camera_name = "the default camera"; ///< for the notice
  /// Depths the sensor can deliver, m; pixels of a depth image outside are invalid.
  double min_range_m = 0.0;
  double max_range_m = std::numeric_limits<double>::infinity();

  /// Metres per unit of the coordinates: 1e-3 for a cloud in mm. Not of depth images.
  double unit_m = 1.0;
  /// Axes of the sensor's frame, which for a file without a viewpoint is that of the
  /// points. Not given: camera axes, unless the points contradict them.
  std::optional<CloudAxes> axes;
  /// Where the sensor stood in the frame of the file, m, in place of the file's own
  /// viewpoint: a pose, or a position alone.
  std::optional<Pose> sensor_pose;
  std::optional<Eigen::Vector3d> viewpoint;

  /// Keep the colours of the points, in CloudFileInfo::colors.
  bool colors = false;

  /// A file that announces more points is an error, before anything is unpacked.
  std::uint64_t max_points = 50000000;
};

/// What a file said about its cloud, and what was made of it.
struct CloudFileInfo {
  std::string format; ///< "PCD ascii", "PLY binary_little_endian", "PNG depth", ...
  std::vector<std::string> fields; ///< names in the order of the file
  /// The file's own sensor pose in its frame, m. PCL's default, 0 0 0 and no rotation,
  /// is none.
  std::optional<Pose> viewpoint;
  bool is_depth_image = false;
  /// Camera of a depth image, or the one the caller gave for a cloud.
  std::optional<Camera> camera;
  double unit_m = 1.0; ///< as applied
  double depth_scale = 1000.0; ///< as applied to a depth image
  CloudAxes axes = CloudAxes::Camera; ///< as applied
  int zero_points = 0; ///< taken as invalid: 0 0 0 stands for "no return"
  int out_of_range_pixels = 0; ///< taken as invalid
  std::vector<std::string> notices; ///< one line each: what the reader had to decide
  /// Red, green, blue of every point, where the caller asked for them and a PCD has rgb
  /// or rgba, a PLY red, green and blue of one byte each; else empty.
  std::vector<std::array<std::uint8_t, 3>> colors;
};

/// Reads PCD (ascii, binary, binary_compressed, v0.5 and newer), PLY (ascii, binary,
/// any number type) and 16-bit depth images (gray PNG, binary and text PGM); the
/// content decides, then the extension. The path "-" is standard input.
///
/// PCD, depth images and PLY files that describe a grid (range_grid, or num_cols and
/// num_rows, or the camera's viewport) come out organized. A PCD field `covariance` of
/// six numbers (xx xy xz yy yz zz, m^2) or of nine (row-major and symmetric) becomes
/// the covariances of the cloud, unchecked (countInvalidCovariances).
///
/// The sensor pose is the caller's; else that of VIEWPOINT or of the camera element of
/// a PLY, unless the points contradict it (chooseSensorPose); else the identity. Points
/// that are not finite, and zeros that stand for no return, become NaN. Coordinates too
/// large for float are shifted by RangeCloud::offset.
/// \throw std::runtime_error "FILE: cause" when the file is missing, empty, truncated,
/// corrupt, too large, without x, y and z or without one valid point, and when the
/// values of a depth image cannot be depths of this sensor at this scale.
/// \throw std::invalid_argument when depth_scale or unit_m is not a positive number, or
/// sensor_pose and viewpoint are both given or not finite.
RangeCloud loadCloud(const std::string& path,
                     const LoadOptions& options = {},
                     CloudFileInfo* info = nullptr);

/// Writes a PCD with the sensor pose as VIEWPOINT and, when there are any, the
/// covariances as the field `covariance`. Text keeps every bit. The coordinates of a
/// cloud with an offset are written in the frame of its file and in double precision.
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
