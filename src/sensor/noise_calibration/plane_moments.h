/// \file Least-squares planes in disparity from sums that can be added.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>

namespace holdfast {

/// d = level + slope . ((u, v) - at).
struct DisparityPlane {
  Eigen::Vector2d at;
  double level;
  Eigen::Vector2d slope;

  double operator()(const Eigen::Vector2d& pixel) const
  {
    return level + slope.dot(pixel - at);
  }
};

/// Number, mean and scatter of points (u, v, d). Moments of a union are the sum of the
/// moments, and the plane of a region follows from them without its pixels.
struct PlaneMoments {
  double count = 0.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero(); ///< about the mean

  /// Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for computing
  /// sample variances", 1979: no cancellation of large sums.
  PlaneMoments& operator+=(const PlaneMoments& other)
  {
    if (other.count == 0.0)
      return *this;
    const double sum = count + other.count;
    const Eigen::Vector3d step = other.mean - mean;
    scatter += other.scatter + count * other.count / sum * step * step.transpose();
    mean += other.count / sum * step;
    count = sum;
    return *this;
  }

  void add(double u, double v, double d)
  {
    *this += {1.0, {u, v, d}, Eigen::Matrix3d::Zero()};
  }

  /// At least three points that do not lie on one line of the image.
  bool hasPlane() const
  {
    return count > 3.0 && scatter.topLeftCorner<2, 2>().determinant() > 0.0;
  }

  DisparityPlane plane() const
  {
    const Eigen::Matrix2d inverse = scatter.topLeftCorner<2, 2>().inverse();
    return {mean.head<2>(), mean.z(), inverse * scatter.topRightCorner<2, 1>()};
  }

  /// Sum of squared residuals to any plane.
  double residual(const DisparityPlane& plane) const
  {
    const Eigen::Vector3d e(-plane.slope.x(), -plane.slope.y(), 1.0);
    const double offset = mean.z() - plane(mean.head<2>());
    return std::max(0.0, e.dot(scatter * e)) + count * offset * offset;
  }

  /// Residual variance about the own plane: without bias, having paid for its three
  /// parameters.
  double variance() const
  {
    return residual(plane()) / (count - 3.0);
  }
};

} // namespace holdfast
