/// \file The largest plane that a camera recorded, as the truth for patches on it.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace holdfast::app {

/// The plane normal . q = offset, frame of the cloud, and the pixels that lie on it.
struct RecordedPlane {
  Eigen::Vector3d normal; ///< unit length
  double offset_m = 0.0;
  /// By pixel of the cloud: on the plane, and so are those around it.
  std::vector<bool> inside;
  int pixels = 0; ///< that are inside
  double mean_depth_m = 0.0; ///< z in the camera frame
  /// Rms of their inverse depths about the plane, in sigmas of single points.
  double rms_sigmas = 0.0;
};

/// Fewer pixels are no plane of a whole: it would have errors of its own as large as
/// those of the patches on it.
inline constexpr int kLeastPlanePixels = 20000;

/// Random sampling and weighted least squares in inverse depth, which over the pixels
/// of a plane is affine,
///
///     1/z = a u + b v + c,    with the variance Sigma_zz / z^4 of a single point.
///
/// Pixels within four sigmas of the plane are on it. Inside are those in whose
/// surrounding of 17 x 17 px 98 % are: objects are not lower than that noise (16 mm for
/// a Kinect at 1 m) for long, so that their feet are farther away. The largest piece
/// that hangs together counts, and the plane is that of its pixels.
/// \param cloud organized.
/// \return nothing where no piece has kLeastPlanePixels.
std::optional<RecordedPlane> findLargestPlane(const RangeCloud& cloud,
                                              const Sensor& sensor,
                                              std::uint64_t seed);

} // namespace holdfast::app
