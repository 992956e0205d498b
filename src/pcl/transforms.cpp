#include <holdfast/pcl/transforms.h>

#include "geometry/symmetric.h"
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/pcl/conversions.h>

#include <Eigen/LU>

#include <pcl/common/transforms.h>

#include <cmath>

namespace holdfast {

namespace {

Eigen::Matrix3f
rotated(const Eigen::Matrix3f& Sigma, const Eigen::Matrix3f& R)
{
  return R * Sigma * R.transpose();
}

template <typename PointT>
void
moveSensor(const Pose& T, pcl::PointCloud<PointT>& cloud)
{
  writeSensorPose(T * sensorPose(cloud.sensor_origin_, cloud.sensor_orientation_),
                  cloud);
}

void
swapRows(ParameterMatrix& A, int i, int j)
{
  A.row(i).swap(A.row(j));
}

/// Derivative of the tangent coordinates [d | k | delta | c] of `to` with respect to
/// those of `from`, where `to` is T * from in another representation: its frame is
/// turned by Q about the normal, R_to = T.R R_from Q, and R Exp(delta) Q =
/// R Q Exp(Q^T delta).
ParameterMatrix
representationJacobian(const Patch& from, const Patch& to, const Pose& T)
{
  const ParameterLayout layout = layoutOf(from.type);
  const Eigen::Matrix3d Q = (T.R * from.pose().R).transpose() * to.pose().R;
  ParameterMatrix A = ParameterMatrix::Identity(layout.size(), layout.size());
  A.block(layout.r(), layout.r(), layout.r_count, layout.r_count) =
      Q.transpose().topLeftCorner(layout.r_count, layout.r_count);
  A.bottomRightCorner<3, 3>() = T.R;
  if (isRevolute(from.type))
    return A;
  // Bounds and curvatures are those along the axes: they change places with them.
  const bool quad = from.type.boundary == BoundaryType::Quad;
  if (std::abs(Q(0, 0)) < std::abs(Q(1, 0))) {
    swapRows(A, 0, 1);
    if (layout.k_count == 2)
      swapRows(A, layout.k(), layout.k() + 1);
  }
  else if (quad && Q(0, 0) < 0.0) {
    swapRows(A, 0, 2);
    swapRows(A, 1, 3);
  }
  return A;
}

/// The state's own frame follows its normal, and is turned about it by that.
void
moveState(const Pose& T, FitResult& moved)
{
  const PatchState before = moved.state;
  PatchState& state = moved.state;
  state.normal = T.R * before.normal;
  state.centre = T.toWorld(before.centre);
  const Eigen::Matrix3d W = state.frame().transpose() * T.R * before.frame();
  const Eigen::Matrix3d turn = symmetric::planeTurn(W.topLeftCorner<2, 2>());
  state.moments = turn * before.moments;
  state.curvature = turn * before.curvature;
  if (moved.state_covariance.size() == 0)
    return;
  const StateLayout layout = stateLayoutOf(state.type);
  StateMatrix J = StateMatrix::Identity(layout.size(), layout.size());
  if (layout.m_count == 3)
    J.topLeftCorner<3, 3>() = turn;
  if (layout.k_count == 3)
    J.block<3, 3>(layout.k(), layout.k()) = turn;
  J.block<2, 2>(layout.nu(), layout.nu()) = W.topLeftCorner<2, 2>();
  J.bottomRightCorner<3, 3>() = T.R;
  moved.state_covariance = propagate(J, moved.state_covariance);
  if (moved.white_state_covariance->size() > 0)
    moved.white_state_covariance = propagate(J, *moved.white_state_covariance);
  if (moved.state_mean_shift->size() > 0)
    moved.state_mean_shift = StateVector(J * *moved.state_mean_shift);
}

} // namespace

Pose
toPose(const Eigen::Isometry3d& transform)
{
  const Eigen::Quaterniond q(transform.linear());
  return {q.normalized().toRotationMatrix(), transform.translation()};
}

FitResult
transformed(const FitResult& fit, const Pose& T)
{
  FitResult moved = fit;
  moved.patch = transformed(fit.patch, T);
  if (isRevolute(moved.patch.type))
    moved.patch.r.head<2>() = regularRxyFromNormal(moved.patch.normal());
  moveState(T, moved);
  if (fit.covariance.size() == 0)
    return moved;
  const Eigen::FullPivLU<ParameterMatrix> chart(tangentJacobian(moved.patch));
  const ParameterMatrix J = chart.solve(
      representationJacobian(fit.patch, moved.patch, T) * tangentJacobian(fit.patch));
  moved.covariance = propagate(J, fit.covariance);
  if (fit.mean_shift->size() > 0)
    moved.mean_shift = ParameterVector(J * *fit.mean_shift);
  return moved;
}

std::vector<ExtractedPatch>
transformPatches(const std::vector<ExtractedPatch>& patches, const Pose& T)
{
  std::vector<ExtractedPatch> moved = patches;
  for (ExtractedPatch& patch : moved) {
    patch.seed = T.toWorld(patch.seed);
    if (isAccepted(patch))
      patch.fit = transformed(patch.fit, T);
  }
  return moved;
}

void
transformPatches(const pcl::PointCloud<PatchPoint>& cloud_in,
                 pcl::PointCloud<PatchPoint>& cloud_out,
                 const Eigen::Isometry3d& transform)
{
  const Pose T = toPose(transform);
  cloud_out = cloud_in;
  for (PatchPoint& point : cloud_out) {
    ExtractedPatch patch = toExtractedPatch(point);
    if (!isAccepted(patch))
      continue;
    patch.fit = transformed(patch.fit, T);
    point = toPatchPoint(patch);
  }
  moveSensor(T, cloud_out);
}

void
transformPointCloudWithCovariances(const pcl::PointCloud<PointXYZCovariance>& cloud_in,
                                   pcl::PointCloud<PointXYZCovariance>& cloud_out,
                                   const Eigen::Isometry3d& transform)
{
  pcl::transformPointCloud(cloud_in, cloud_out, transform.cast<float>());
  const Pose T = toPose(transform);
  const Eigen::Matrix3f R = T.R.cast<float>();
  for (PointXYZCovariance& point : cloud_out)
    point.setCovariance(rotated(point.getCovarianceMatrix(), R));
  moveSensor(T, cloud_out);
}

Covariances
transformCovariances(const Covariances& covariances, const Eigen::Isometry3d& transform)
{
  const Eigen::Matrix3f R = toPose(transform).R.cast<float>();
  Covariances moved;
  moved.reserve(covariances.size());
  for (const Eigen::Matrix3f& Sigma : covariances)
    moved.push_back(rotated(Sigma, R));
  return moved;
}

} // namespace holdfast
