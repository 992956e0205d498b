/// \file Third derivatives of a surface as functions of the plane.
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// x^3/6, x^2 y/2, x y^2/2, y^3/6.
inline Eigen::Vector4d
cubicBasis(double x, double y)
{
  return {x * x * x / 6.0, x * x * y / 2.0, x * y * y / 2.0, y * y * y / 6.0};
}

/// Third derivatives in axes that are the columns of W, from those in the old ones.
inline Eigen::Matrix4d
turnOfThird(const Eigen::Matrix2d& W)
{
  // The derivative along three directions.
  const auto along =
      [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
        return Eigen::RowVector4d(
            a[0] * b[0] * c[0],
            a[0] * b[0] * c[1] + a[0] * b[1] * c[0] + a[1] * b[0] * c[0],
            a[0] * b[1] * c[1] + a[1] * b[0] * c[1] + a[1] * b[1] * c[0],
            a[1] * b[1] * c[1]);
      };
  const Eigen::Vector2d x = W.col(0), y = W.col(1);
  Eigen::Matrix4d T;
  T << along(x, x, x), along(x, x, y), along(x, y, y), along(y, y, y);
  return T;
}

} // namespace holdfast
