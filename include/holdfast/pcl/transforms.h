/// \file Rigid transforms that take covariances along.
///
/// pcl::transformPointCloud moves positions and leaves covariances, patches and the
/// sensor where they were. Like PCL's, these may be called with input and output the
/// same cloud.
#pragma once

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/pcl/point_types.h>

#include <pcl/point_cloud.h>

#include <Eigen/Geometry>

namespace holdfast {

/// A transform as a pose, its rotation made orthonormal beyond the rounding of whatever
/// it came from.
Pose toPose(const Eigen::Isometry3d& transform);

/// The fit in another frame: the patch T * patch in canonical form and the covariance
/// of its parameters, as the fit to the moved points gives them. (Second-order terms
/// and the mean shift only nearly so: the map between the two sets of parameters is
/// taken to first order.) A revolute patch whose moved normal is -z to within a
/// microradian is turned off it by as much (regularRxyFromNormal), where its parameters
/// have a finite covariance. \param T q_new = T.R q_old + T.c.
FitResult transformed(const FitResult& fit, const Pose& T);

/// Every patch, its seed and its covariance; points without a patch stay as they are.
std::vector<ExtractedPatch> transformPatches(const std::vector<ExtractedPatch>& patches,
                                             const Pose& T);

/// The same for patch points, and for the sensor pose of their cloud.
/// \throw std::invalid_argument for points that toExtractedPatch() does not take.
void transformPatches(const pcl::PointCloud<PatchPoint>& cloud_in,
                      pcl::PointCloud<PatchPoint>& cloud_out,
                      const Eigen::Isometry3d& transform);

/// Positions as pcl::transformPointCloud does them, covariances R Sigma R^T, and the
/// sensor pose.
void transformPointCloudWithCovariances(
    const pcl::PointCloud<PointXYZCovariance>& cloud_in,
    pcl::PointCloud<PointXYZCovariance>& cloud_out,
    const Eigen::Isometry3d& transform);

/// Covariances that stand beside a cloud, R Sigma R^T.
Covariances transformCovariances(const Covariances& covariances,
                                 const Eigen::Isometry3d& transform);

} // namespace holdfast
