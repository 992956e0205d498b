#include "discrimination.h"

#include "geometry/symmetric.h"

#include <Eigen/Cholesky>

#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

SurfaceType
twoCurvatureType(double k_min, double k_max)
{
  return k_min * k_max < 0.0 ? SurfaceType::HyperbolicParaboloid :
                               SurfaceType::EllipticParaboloid;
}

// The paper's rule.
SurfaceType
discriminateByThreshold(double k_min, double k_max, double tolerance)
{
  if (std::abs(k_max) < tolerance)
    return SurfaceType::Plane;
  if (std::abs(k_min) < tolerance)
    return SurfaceType::CylindricParaboloid;
  if (std::abs(k_max - k_min) < tolerance)
    return SurfaceType::CircularParaboloid;
  return twoCurvatureType(k_min, k_max);
}

// x^T S^-1 x.
template <int n>
double
mahalanobisSquared(const Eigen::Matrix<double, n, 1>& x,
                   const Eigen::Matrix<double, n, n>& S)
{
  return x.dot(S.llt().solve(x));
}

} // namespace

DiscriminationThresholds
DiscriminationThresholds::atLevel(double level)
{
  const auto quantile = [level](double dof) {
    return boost::math::quantile(
        boost::math::complement(boost::math::chi_squared(dof), level));
  };
  return {quantile(3), quantile(2), quantile(1)};
}

SurfaceType
discriminate(const Eigen::Vector3d& k,
             const Eigen::Matrix3d& C,
             const DiscriminationThresholds& thresholds,
             const FitOptions& options)
{
  const symmetric::PlaneAxes axes = symmetric::planeAxes(k[0], k[1], k[2]);
  const double k_min = axes.smaller, k_max = axes.larger;
  const double tolerance = options.curvature_tolerance_per_m;
  if (!options.statistical_discrimination)
    return discriminateByThreshold(k_min, k_max, tolerance);

  if (std::abs(k_max) < tolerance || mahalanobisSquared<3>(k, C) < thresholds.plane)
    return SurfaceType::Plane;

  Eigen::Matrix<double, 2, 3> M;
  M << 1.0, 0.0, -1.0, 0.0, 2.0, 0.0;
  const double circular =
      mahalanobisSquared<2>(M * k, M * C * M.transpose()) / thresholds.circular;
  const Eigen::Vector2d& axis = axes.along_smaller;
  const Eigen::Vector3d a(axis.x() * axis.x(),
                          2.0 * axis.x() * axis.y(),
                          axis.y() * axis.y());
  const double cylindric = k_min * k_min / a.dot(C * a) / thresholds.cylindric;
  const bool is_circular = circular < 1.0 || std::abs(k_max - k_min) < tolerance;
  const bool is_cylindric = cylindric < 1.0 || std::abs(k_min) < tolerance;
  if (is_circular && (!is_cylindric || circular < cylindric))
    return SurfaceType::CircularParaboloid;
  if (is_cylindric)
    return SurfaceType::CylindricParaboloid;
  return twoCurvatureType(k_min, k_max);
}

} // namespace holdfast
