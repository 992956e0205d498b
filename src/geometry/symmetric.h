// Symmetric 3x3 matrices as six numbers, xx xy xz yy yz zz: the order of the sums of
// the fit, of its moments and of their Jacobians.
#pragma once

#include <Eigen/Core>

#include <cmath>

namespace holdfast { namespace symmetric {

inline constexpr int kSize = 6;

// Row and column of entry e; row <= column.
inline constexpr int kRow[kSize] = {0, 0, 0, 1, 1, 2};
inline constexpr int kColumn[kSize] = {0, 1, 2, 1, 2, 2};

// Entry at (row, column).
inline constexpr int kIndex[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

inline Eigen::Matrix<double, kSize, 1>
entriesOf(const Eigen::Matrix3d& matrix)
{
  Eigen::Matrix<double, kSize, 1> entries;
  for (int e = 0; e < kSize; ++e)
    entries[e] = matrix(kRow[e], kColumn[e]);
  return entries;
}

template <typename Entries>
Eigen::Matrix3d
matrixOf(const Entries& entries)
{
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      matrix(i, j) = entries[kIndex[i][j]];
  return matrix;
}

// From the entries xx xy yy of a symmetric matrix in a plane to those in axes turned by
// W, from the old to the new.
inline Eigen::Matrix3d
planeTurn(const Eigen::Matrix2d& W)
{
  const double a = W(0, 0), b = W(0, 1), c = W(1, 0), d = W(1, 1);
  Eigen::Matrix3d T;
  T << a * a, 2.0 * a * b, b * b, a * c, a * d + b * c, b * d, c * c, 2.0 * c * d,
      d * d;
  return T;
}

// The same for axes turned by an angle.
inline Eigen::Matrix3d
planeTurn(double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  Eigen::Matrix2d W;
  W << c, s, -s, c;
  return planeTurn(W);
}

// The same for axes turned by the angle of a vector (c, s) of any length.
inline Eigen::Matrix3d
planeTurn(double c, double s)
{
  Eigen::Matrix2d W;
  W << c, s, -s, c;
  return planeTurn(W) / (c * c + s * s);
}

// Principal axes of the symmetric matrix xx xy yy in a plane. Written out: Eigen's
// solver costs every file that has one for this size seconds.
struct PlaneAxes {
  double smaller, larger; // eigenvalues by their magnitude
  Eigen::Vector2d along_smaller; // unit
};

inline PlaneAxes
planeAxes(double xx, double xy, double yy)
{
  const double mean = 0.5 * (xx + yy), half = 0.5 * (xx - yy);
  const double radius = std::hypot(half, xy);
  // Of the upper eigenvalue; cosine and sine of half the angle of (half, xy).
  double c = 1.0, s = 0.0;
  if (radius > 0.0) {
    const double larger = std::sqrt(0.5 + 0.5 * std::abs(half) / radius);
    const double other = 0.5 * xy / radius / larger;
    c = half < 0.0 ? std::abs(other) : larger;
    s = half < 0.0 ? std::copysign(larger, xy) : other;
  }
  return mean < 0.0 ? PlaneAxes{mean + radius, mean - radius, {c, s}} :
                      PlaneAxes{mean - radius, mean + radius, {-s, c}};
}

}} // namespace holdfast::symmetric
