/// \file Point types of our own, registered with PCL: its files, filters and searches
/// take them like its own.
#pragma once

#include <pcl/memory.h>
#include <pcl/pcl_macros.h>
#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

#include <Eigen/Core>

#include <cstdint>
#include <limits>

namespace holdfast {

/// A measured point and the covariance of its noise, in the frame of its cloud.
///
/// The covariance of a new point is NaN, unknown: PCL's filters that make points of
/// their own (VoxelGrid) leave it so, and the fit leaves such points out rather than
/// taking them for exact. pcl::transformPointCloud does not rotate it; see
/// transformPointCloudWithCovariances().
struct EIGEN_ALIGN16 PointXYZCovariance {
  PCL_ADD_POINT4D
  float covariance[6]; ///< xx xy xz yy yz zz, m^2

  PointXYZCovariance()
  : PointXYZCovariance(
        Eigen::Vector3f::Zero(),
        Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN()))
  {}

  PointXYZCovariance(const Eigen::Vector3f& position, const Eigen::Matrix3f& Sigma)
  {
    getVector3fMap() = position;
    data[3] = 1.0F;
    setCovariance(Sigma);
  }

  Eigen::Matrix3f getCovarianceMatrix() const
  {
    const float* s = covariance;
    Eigen::Matrix3f Sigma;
    Sigma << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    return Sigma;
  }

  /// Takes the upper triangle.
  void setCovariance(const Eigen::Matrix3f& Sigma)
  {
    int slot = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j)
        covariance[slot++] = Sigma(i, j);
  }

  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

/// A fitted patch as a point at its centre with its normal (towards the sensor).
///
/// Where no patch was found, or validation turned it down, position, normal,
/// parameters, state and covariances are NaN, and `status` and `verdict` say why.
/// `residual` and `coverage` are NaN where they were not measured. toPatchPoint() and
/// toExtractedPatch() in conversions.h translate.
struct EIGEN_ALIGN16 PatchPoint {
  PCL_ADD_POINT4D
  PCL_ADD_NORMAL4D
  /// [d | k | r | c] in m, 1/m and rad (holdfast/patch/parameters.h); zero after the
  /// last one the type has.
  float parameters[11] = {};
  /// Upper triangle of their covariance, row by row; zero after the last entry. Named
  /// so that no reader takes it for the covariance of a point.
  float parameter_covariance[66] = {};
  /// One field for all that belongs to the state, since PCL's point types end at twenty
  /// fields: [M | k | nu | c] in m^2, 1/m and m (holdfast/patch/state.h; nu is zero),
  /// the upper triangle of its covariance as parameter_covariance, the mean of chi2
  /// where surface and noise are right, FitResult::nonlinearity, and FitFlags as 1, 2
  /// and 4.
  float state[80] = {};
  static constexpr int kStateCovariance = 11;
  static constexpr int kChi2Expected = 77;
  static constexpr int kNonlinearity = 78;
  static constexpr int kFlags = 79;
  float residual = 0.0F; ///< rms distance of the points from the surface, m
  float coverage = 0.0F; ///< share of the patch that points support
  float chi2 = 0.0F; ///< sum of squared residuals over the point covariances
  std::int32_t chi2_dof = 0; ///< points minus surface parameters
  std::int32_t points = 0; ///< points used
  std::int32_t seed = -1; ///< index of the seed in the input cloud; -1: none
  float radius = 0.0F; ///< of the neighbourhood, m
  std::uint8_t surface = 0; ///< SurfaceType
  std::uint8_t boundary = 0; ///< BoundaryType
  std::uint8_t status = 0; ///< FitStatus
  std::uint8_t verdict = 0; ///< PatchVerdict

  PatchPoint()
  {
    getVector4fMap() = Eigen::Vector4f::UnitW();
    getNormalVector4fMap().setZero();
  }

  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

} // namespace holdfast

// clang-format off
POINT_CLOUD_REGISTER_POINT_STRUCT(holdfast::PointXYZCovariance,
  (float, x, x)
  (float, y, y)
  (float, z, z)
  (float[6], covariance, covariance))

POINT_CLOUD_REGISTER_POINT_STRUCT(holdfast::PatchPoint,
  (float, x, x)
  (float, y, y)
  (float, z, z)
  (float, normal_x, normal_x)
  (float, normal_y, normal_y)
  (float, normal_z, normal_z)
  (float[11], parameters, parameters)
  (float[66], parameter_covariance, parameter_covariance)
  (float[80], state, state)
  (float, residual, residual)
  (float, coverage, coverage)
  (float, chi2, chi2)
  (std::int32_t, chi2_dof, chi2_dof)
  (std::int32_t, points, points)
  (std::int32_t, seed, seed)
  (float, radius, radius)
  (std::uint8_t, surface, surface)
  (std::uint8_t, boundary, boundary)
  (std::uint8_t, status, status)
  (std::uint8_t, verdict, verdict))
// clang-format on
