/// \file A foothold as a point, registered with PCL as those of point_types.h are.
#pragma once

#include <pcl/memory.h>
#include <pcl/pcl_macros.h>
#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

#include <cstdint>

namespace holdfast {

/// A place for a foot on a patch (ContactRiskEstimation): the sole's origin on the
/// surface and its normal, out of it. Where the patch gives no foothold, all numbers
/// but `support`, `patch` and `status` are NaN.
struct EIGEN_ALIGN16 FootholdPoint {
  PCL_ADD_POINT4D
  PCL_ADD_NORMAL4D
  float orientation[4] = {}; ///< of the sole: w x y z of a quaternion
  /// Upper triangle of ContactQuality::pose_covariance, row by row.
  float pose_covariance[21] = {};
  float slip = 0.0F; ///< the probabilities of ContactEvents
  float height = 0.0F;
  float tilt = 0.0F;
  float gap = 0.0F;
  float support = 0.0F; ///< share of the sole over surface that was not seen
  float total = 0.0F;
  float joint = 0.0F;
  float cvar_gap = 0.0F; ///< m
  float contact_area = 0.0F; ///< m^2
  float yaw = 0.0F; ///< Placement::yaw, rad
  std::int32_t patch = -1; ///< index in the cloud of patches
  std::uint8_t status = 0; ///< ContactStatus

  FootholdPoint()
  {
    getVector4fMap() = Eigen::Vector4f::UnitW();
    getNormalVector4fMap().setZero();
  }

  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

} // namespace holdfast

// clang-format off
POINT_CLOUD_REGISTER_POINT_STRUCT(holdfast::FootholdPoint,
  (float, x, x)
  (float, y, y)
  (float, z, z)
  (float, normal_x, normal_x)
  (float, normal_y, normal_y)
  (float, normal_z, normal_z)
  (float[4], orientation, orientation)
  (float[21], pose_covariance, pose_covariance)
  (float, slip, slip)
  (float, height, height)
  (float, tilt, tilt)
  (float, gap, gap)
  (float, support, support)
  (float, total, total)
  (float, joint, joint)
  (float, cvar_gap, cvar_gap)
  (float, contact_area, contact_area)
  (float, yaw, yaw)
  (std::int32_t, patch, patch)
  (std::uint8_t, status, status))
// clang-format on
