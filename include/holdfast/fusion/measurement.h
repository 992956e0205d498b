/// \file What one view says of one spot of the surface: the input of the patch map.
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/fusion/jet.h>
#include <holdfast/fusion/roughness.h>
#include <holdfast/fusion/support_grid.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>

namespace holdfast {

struct Measurement {
  /// Orders the measurements of a frame: the map does not depend on the order in which
  /// they are given.
  std::uint64_t id = 0;
  /// The patch of the map that asked for it (WantedSeed::patch); 0: nobody did.
  std::uint64_t asked_by = 0;
  /// Its own frame, frame of the sensor: centre of the support, z the normal.
  Pose anchor;
  Jet jet; ///< at that anchor
  /// Of the disc that has the spread of the points, m.
  double radius_m = 0.0;
  int points = 0;
  /// Second moments xx xy yy of the points about the anchor's origin, in its axes, m^2,
  /// and their covariance.
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moments_covariance = Eigen::Matrix3d::Zero();
  SupportGrid support; ///< in its own anchor, for radius_m
  double chi2 = 0.0, chi2_expected = 0.0;
  FitDesign design; ///< at its own anchor
};

/// The measurement that a fit is, its `id` and `asked_by` left open.
/// \param fit of a paraboloid (SurfaceRequest::Paraboloid) to these points, frame of
///        the points, with the pattern apart where there is one.
/// \param batch the points as PatchEstimator::estimate() left them.
/// \param sensor_pose in the frame of the points.
/// \return nothing where the fit is not usable, or is of no paraboloid.
std::optional<Measurement> measurementOf(const FitResult& fit,
                                         const PointBatch& batch,
                                         const Pose& sensor_pose = Pose());

/// The same of a fit whose points are gone: the support is taken to fill the ellipse of
/// its moments, evenly, and chi-square tells nothing of third derivatives.
std::optional<Measurement> measurementOf(const FitResult& fit,
                                         const Pose& sensor_pose = Pose());

} // namespace holdfast
