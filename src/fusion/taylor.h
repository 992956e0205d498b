/// \file Functions of (x, y) as their Taylor polynomials of third degree at the origin.
#pragma once

#include <holdfast/fusion/jet.h>

namespace holdfast {

/// Coefficients of 1, x, y, x^2, xy, y^2, x^3, x^2 y, x y^2, y^3; what is of higher
/// degree is dropped from products and quotients, so that each is exact as far as it
/// goes.
struct Taylor3 {
  double v[10] = {};

  static Taylor3 affine(double constant, double x, double y)
  {
    return {{constant, x, y}};
  }

  Taylor3& operator+=(const Taylor3& b)
  {
    for (int i = 0; i < 10; ++i)
      v[i] += b.v[i];
    return *this;
  }
  Taylor3& operator-=(const Taylor3& b)
  {
    for (int i = 0; i < 10; ++i)
      v[i] -= b.v[i];
    return *this;
  }

  /// Value, gradient and Hessian.
  JetVector jet() const
  {
    return (JetVector() << v[0], v[1], v[2], 2.0 * v[3], v[4], 2.0 * v[5]).finished();
  }

  /// xxx xxy xyy yyy.
  Eigen::Vector4d third() const
  {
    return {6.0 * v[6], 2.0 * v[7], 2.0 * v[8], 6.0 * v[9]};
  }
};

inline Taylor3
operator+(Taylor3 a, const Taylor3& b)
{
  return a += b;
}

inline Taylor3
operator-(Taylor3 a, const Taylor3& b)
{
  return a -= b;
}

inline Taylor3
operator*(double s, Taylor3 a)
{
  for (double& entry : a.v)
    entry *= s;
  return a;
}

inline Taylor3
operator*(const Taylor3& a, const Taylor3& b)
{
  const double *p = a.v, *q = b.v;
  return {{p[0] * q[0],
           p[0] * q[1] + p[1] * q[0],
           p[0] * q[2] + p[2] * q[0],
           p[0] * q[3] + p[3] * q[0] + p[1] * q[1],
           p[0] * q[4] + p[4] * q[0] + p[1] * q[2] + p[2] * q[1],
           p[0] * q[5] + p[5] * q[0] + p[2] * q[2],
           p[0] * q[6] + p[6] * q[0] + p[1] * q[3] + p[3] * q[1],
           p[0] * q[7] + p[7] * q[0] + p[1] * q[4] + p[4] * q[1] + p[2] * q[3] +
               p[3] * q[2],
           p[0] * q[8] + p[8] * q[0] + p[1] * q[5] + p[5] * q[1] + p[2] * q[4] +
               p[4] * q[2],
           p[0] * q[9] + p[9] * q[0] + p[2] * q[5] + p[5] * q[2]}};
}

/// 1/a; a must not be zero at the origin.
inline Taylor3
reciprocal(const Taylor3& a)
{
  // Order by order from a r = 1.
  const double* b = a.v;
  Taylor3 result;
  double* r = result.v;
  r[0] = 1.0 / b[0];
  r[1] = -r[0] * (b[1] * r[0]);
  r[2] = -r[0] * (b[2] * r[0]);
  r[3] = -r[0] * (b[3] * r[0] + b[1] * r[1]);
  r[4] = -r[0] * (b[4] * r[0] + b[1] * r[2] + b[2] * r[1]);
  r[5] = -r[0] * (b[5] * r[0] + b[2] * r[2]);
  r[6] = -r[0] * (b[6] * r[0] + b[3] * r[1] + b[1] * r[3]);
  r[7] = -r[0] * (b[7] * r[0] + b[4] * r[1] + b[3] * r[2] + b[1] * r[4] + b[2] * r[3]);
  r[8] = -r[0] * (b[8] * r[0] + b[5] * r[1] + b[4] * r[2] + b[1] * r[5] + b[2] * r[4]);
  r[9] = -r[0] * (b[9] * r[0] + b[5] * r[2] + b[2] * r[5]);
  return result;
}

} // namespace holdfast
