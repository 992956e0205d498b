#include "reference_surface.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <limits>
#include <utility>

namespace holdfast {
namespace {

// Least squares for n of the monomials 1 s t ss st tt, in units in which the samples
// spread over about one. What the coefficients explain of the sum of squares is in
// `explained`.
template <int n>
bool
solve(const RaySamples& samples,
      double scale,
      std::array<double, 6>& h,
      double& explained)
{
  using Matrix = Eigen::Matrix<double, n, n>;
  using Vector = Eigen::Matrix<double, n, 1>;
  // Row by row, which adds whole rows at a time.
  Eigen::Matrix<double, RaySamples::kMost, n + 1> rows;
  const int count = samples.size;
  for (int i = 0; i < count; ++i) {
    const double s = samples.s[i] / scale, t = samples.t[i] / scale;
    const double monomials[6] = {1.0, s, t, s * s, s * t, t * t};
    for (int j = 0; j < n; ++j)
      rows(i, j) = monomials[j];
    // Less the first, so that the sums of squares keep their digits.
    rows(i, n) = samples.inverse_depth[i] - samples.inverse_depth[0];
  }
  // Column by column: Eigen's product of matrices this narrow costs twice as much.
  const auto used = rows.topRows(count);
  Eigen::Matrix<double, n + 1, n + 1> sums;
  for (int i = 0; i <= n; ++i)
    for (int j = i; j <= n; ++j)
      sums(i, j) = sums(j, i) = used.col(i).dot(used.col(j));
  const Matrix A = sums.template topLeftCorner<n, n>();
  const Vector b = sums.template topRightCorner<n, 1>();
  const Eigen::LLT<Matrix> cholesky(A);
  // Of points on a line or a conic, rounding leaves pivots of some 1e-16.
  constexpr double kSmallestPivot = 1e-6;
  if (cholesky.info() != Eigen::Success ||
      cholesky.matrixLLT().diagonal().cwiseAbs2().minCoeff() < kSmallestPivot * count)
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
         solve<3>(samples, scale, h, explained) && take(h);
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
  if (!(scale > 0.0) || !solve<3>(samples, scale, plane, by_plane))
    return false;
  const bool bends = solve<6>(samples, scale, quadric, by_quadric) &&
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
, ray_(surface.seedRay())
, point_(surface.point())
, normal_(surface.normal())
, squared_radius_(radius_m * radius_m)
{}

std::pair<double, double>
LateralDisc::chord(double t) const
{
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const std::array<double, 6>& h = surface_.coefficients();
  // On the tangent plane rho = p + q s and the points are at (g + s d) / rho from the
  // seed's, so the squared distance is a quadratic in s.
  const double p = h[0] + h[2] * t, q = h[1];
  const Eigen::Vector3d g = Eigen::Vector3d(ray_.x(), ray_.y() + t, 1.0) - p * point_;
  const Eigen::Vector3d d = Eigen::Vector3d::UnitX() - q * point_;
  const double A = d.squaredNorm() - squared_radius_ * q * q;
  const double B = g.dot(d) - squared_radius_ * p * q;
  const double C = g.squaredNorm() - squared_radius_ * p * p;
  if (!(A > 0.0))
    return {-kEndless, kEndless};
  const double discriminant = B * B - A * C;
  if (discriminant < 0.0)
    return {kEndless, -kEndless};
  const double root = std::sqrt(discriminant);
  return {(-B - root) / A, (-B + root) / A};
}

} // namespace holdfast
