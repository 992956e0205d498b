#ifdef HOLDFAST_HAVE_CERES

#include "ceres_paraboloid.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Eigenvalues>

#include <utility>
#include <vector>

namespace holdfast::benchmarks {

namespace {

/// f / sqrt(g Sigma g^T) of one point, with f = x' K x - 2 z in the local frame, which
/// is turned by delta and lies `a` along the normal of the principal axes.
struct WeightedResidual {
  template <typename T>
  bool operator()(const T* p, T* residual) const
  {
    const T shifted[3] = {T(point[0]), T(point[1]), point[2] - p[5]};
    const T back[3] = {-p[3], -p[4], T(0.0)};
    T q[3];
    ceres::AngleAxisRotatePoint(back, shifted, q);
    const T kx = p[0] * q[0] + p[1] * q[1];
    const T ky = p[1] * q[0] + p[2] * q[1];
    const T f = kx * q[0] + ky * q[1] - 2.0 * q[2];

    const T local_gradient[3] = {2.0 * kx, 2.0 * ky, T(-2.0)};
    const T forth[3] = {p[3], p[4], T(0.0)};
    T g[3];
    ceres::AngleAxisRotatePoint(forth, local_gradient, g);
    T variance(0.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        variance += g[i] * covariance(i, j) * g[j];
    *residual = f / sqrt(variance);
    return true;
  }

  Eigen::Vector3d point; ///< principal axes, about the centroid
  Eigen::Matrix3d covariance;
};

std::vector<WeightedResidual>
inPrincipalAxes(const PointBatch& batch)
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < batch.size(); ++i)
    mean += batch.point(i) / batch.size();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < batch.size(); ++i)
    scatter += (batch.point(i) - mean) * (batch.point(i) - mean).transpose();
  Eigen::Matrix3d R =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
  R.col(0).swap(R.col(2)); // the normal last; a mirrored frame does for this purpose
  std::vector<WeightedResidual> residuals;
  for (int i = 0; i < batch.size(); ++i)
    residuals.push_back({R.transpose() * (batch.point(i) - mean),
                         R.transpose() * batch.covariance(i) * R});
  return residuals;
}

} // namespace

CeresFit
fitWithCeres(const PointBatch& batch)
{
  CeresFit fit;
  double* p = fit.parameters.data();
  ceres::Problem problem;
  for (const WeightedResidual& residual : inPrincipalAxes(batch))
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<WeightedResidual, 1, 6>(
                                 new WeightedResidual(residual)),
                             nullptr,
                             p);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  fit.converged = summary.termination_type == ceres::CONVERGENCE;

  ceres::Covariance::Options covariance_options;
  covariance_options.num_threads = 1;
  ceres::Covariance covariance(covariance_options);
  const std::vector<std::pair<const double*, const double*>> blocks{{p, p}};
  if (covariance.Compute(blocks, &problem))
    covariance.GetCovarianceBlock(p, p, fit.covariance.data());
  return fit;
}

} // namespace holdfast::benchmarks

#endif
