#include "reference_surface.h"

#include "pixel_vectors.h"

#include <Eigen/Cholesky>

#include <cmath>

namespace holdfast {
namespace {

// The normal equations of the first n of the monomials 1 s t ss st tt, and the
// right-hand side as their last column; slopes in units in which the samples spread
// over about one, inverse depths less the first, so that squares keep their digits.
template <int n>
Eigen::Matrix<double, n, n + 1>
normalEquations(const SampleSums& sums)
{
  constexpr int kOfS[6] = {0, 1, 0, 2, 1, 0}, kOfT[6] = {0, 0, 1, 0, 1, 2};
  Eigen::Matrix<double, n, n + 1> equations;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int power = monomialIndex(kOfS[i] + kOfS[j], kOfT[i] + kOfT[j]);
      equations(i, j) = sums.powers[static_cast<std::size_t>(power)];
    }
    equations(i, n) = sums.with_rho[static_cast<std::size_t>(i)];
  }
  return equations;
}

// Least squares for the first n of the monomials. What the coefficients explain of the
// sum of squares is in `explained`.
template <int n>
bool
solve(const SampleSums& sums,
      const RaySamples& samples,
      double scale,
      std::array<double, 6>& h,
      double& explained)
{
  using Matrix = Eigen::Matrix<double, n, n>;
  using Vector = Eigen::Matrix<double, n, 1>;
  const Eigen::Matrix<double, n, n + 1> equations = normalEquations<n>(sums);
  const Vector b = equations.col(n);
  const Eigen::LLT<Matrix> cholesky(equations.template leftCols<n>());
  // Of points on a line or a conic, rounding leaves pivots of some 1e-16.
  constexpr double kSmallestPivot = 1e-6;
  if (cholesky.info() != Eigen::Success ||
      cholesky.matrixLLT().diagonal().cwiseAbs2().minCoeff() <
          kSmallestPivot * samples.size)
    return false;
  Vector x = cholesky.solve(b);
  explained = x.dot(b);
  x[0] += samples.inverse_depth[0];
  const double area = scale * scale;
  const double units[6] = {1.0, scale, scale, area, area, area};
  for (int i = 0; i < 6; ++i)
    h[static_cast<std::size_t>(i)] = i < n ? x[i % n] / units[i] : 0.0;
  return true;
}

double
spread(const RaySamples& samples)
{
  double sum = 0.0;
  for (int i = 0; i < samples.size; ++i)
    sum += samples.s[i] * samples.s[i] + samples.t[i] * samples.t[i];
  return std::sqrt(sum / samples.size);
}

} // namespace

ReferenceSurface::ReferenceSurface(const Eigen::Vector2d& ray, double depth_m)
: ray_(ray), h_{1.0 / depth_m}
{}

bool
ReferenceSurface::fitPlane(const RaySamples& samples)
{
  constexpr int kFew = 5;
  const double scale = spread(samples);
  double explained = 0.0;
  std::array<double, 6> h{};
  return samples.size >= kFew && scale > 0.0 &&
         solve<3>(sumSamples(samples, 1, scale), samples, scale, h, explained) &&
         take(h);
}

bool
ReferenceSurface::fitQuadric(const RaySamples& samples, double sigma)
{
  // Fewer say little about the curvature.
  constexpr int kFew = 15;
  // Chi-square of the three terms of second order, exceeded by noise in one of a
  // hundred.
  constexpr double kSignificant = 11.3;
  if (samples.size < kFew)
    return fitPlane(samples);
  const double scale = spread(samples);
  std::array<double, 6> plane{}, quadric{};
  double by_plane = 0.0, by_quadric = 0.0;
  if (!(scale > 0.0))
    return false;
  const SampleSums sums = sumSamples(samples, 2, scale);
  if (!solve<3>(sums, samples, scale, plane, by_plane))
    return false;
  const bool bends = solve<6>(sums, samples, scale, quadric, by_quadric) &&
                     by_quadric - by_plane > kSignificant * sigma * sigma;
  return take(bends ? quadric : plane);
}

bool
ReferenceSurface::take(const std::array<double, 6>& h)
{
  const bool before_camera = h[0] > 0.0;
  if (before_camera)
    h_ = h;
  return before_camera;
}

Eigen::Vector3d
ReferenceSurface::point() const
{
  return Eigen::Vector3d(ray_.x(), ray_.y(), 1.0) / h_[0];
}

Eigen::Vector3d
ReferenceSurface::normal() const
{
  // 1 = a z + b (x - x0 z) + c (y - y0 z) on the plane 1/z = a + b s + c t.
  const double a = h_[0], b = h_[1], c = h_[2];
  return Eigen::Vector3d(b, c, a - b * ray_.x() - c * ray_.y()).normalized();
}

LateralDisc::LateralDisc(const ReferenceSurface& surface, double radius_m)
: surface_(surface)
{
  const Eigen::Vector3d point = surface.point(), normal = surface.normal();
  const double rr = radius_m * radius_m;
  excess_ = {{point.x(), point.y(), point.z()},
             {normal.x(), normal.y(), normal.z()},
             rr};
  // On the tangent plane rho = h0 + h1 s + h2 t, and the points are at (g t + d s) /
  // rho from the seed's.
  const double h0 = surface.coefficients()[0], h1 = surface.coefficients()[1];
  const double h2 = surface.coefficients()[2];
  const Eigen::Vector3d g = Eigen::Vector3d::UnitY() - h2 * point;
  const Eigen::Vector3d d = Eigen::Vector3d::UnitX() - h1 * point;
  on_tangent_plane_ = {
      d.squaredNorm() - rr * h1 * h1,
      {-rr * h0 * h1, g.dot(d) - rr * h2 * h1},
      {-rr * h0 * h0, -2.0 * rr * h0 * h2, g.squaredNorm() - rr * h2 * h2}};
}

} // namespace holdfast
