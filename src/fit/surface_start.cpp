#include "fit/surface_start.h"

#include "fit/surface_fit.h"
#include "geometry/small_cholesky.h"

#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <array>
#include <cmath>
#include <limits>

namespace holdfast {

Quadric
leastSquaresQuadric(const kernel::Points& points, const Scatter& scatter)
{
  double R[9], c[3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      R[3 * i + j] = scatter.axes(i, j);
    c[i] = scatter.mean[i];
  }
  kernel::QuadricSums sums;
  kernel::kernel().accumulateQuadric(points, R, c, sums);
  // Row and column e stand for the monomial of exponents (px, py).
  constexpr int px[6] = {0, 1, 0, 2, 1, 0}, py[6] = {0, 0, 1, 0, 1, 2};
  Eigen::Matrix<double, 6, 6> A;
  Eigen::Matrix<double, 6, 1> b;
  for (int e = 0; e < 6; ++e) {
    b[e] = sums.z[e];
    for (int o = 0; o < 6; ++o) {
      const int y = py[e] + py[o], degree = px[e] + px[o] + y;
      A(e, o) = sums.monomial[degree * (degree + 1) / 2 + y];
    }
  }
  Eigen::Matrix<double, 6, 1> scale = A.diagonal().cwiseSqrt();
  for (double& s : scale)
    s = s > 0.0 ? 1.0 / s : 0.0;
  A = (scale.asDiagonal() * A * scale.asDiagonal()).eval();
  const SmallCholesky<6> cholesky(A);
  constexpr double kSmallestPivot = 1e-10; // as the solver's
  if (cholesky.smallestPivot() < kSmallestPivot)
    return {};
  const Eigen::Matrix<double, 6, 1> x =
      scale.cwiseProduct(cholesky.solve(scale.cwiseProduct(b)));
  return {x[0], {x[1], x[2]}, {2.0 * x[3], x[4], 2.0 * x[5]}};
}

UnboundedSurface
quadricStart(kernel::Model model, const StartRequest& request)
{
  const Scatter& scatter = request.scatter;
  const Quadric quadric = leastSquaresQuadric(request.points, scatter);
  UnboundedSurface surface;
  surface.model = model;
  surface.a = quadric.a0;
  surface.c = scatter.mean + surface.a * scatter.normal();
  const double stretch = std::sqrt(1.0 + quadric.slope.squaredNorm());
  const Eigen::Vector3d up =
      Eigen::Vector3d(-quadric.slope.x(), -quadric.slope.y(), 1.0) / stretch;
  // The shortest rotation from z to the normal, which is nearer to z than 90 degrees.
  const Eigen::Matrix3d X = skew({-up.y(), up.x(), 0.0});
  surface.R = scatter.axes * (Eigen::Matrix3d::Identity() + X + X * X / (1.0 + up.z()));
  surface.k = quadric.k / stretch;
  return surface;
}

bool
isThick(const Scatter& scatter)
{
  // A cap of half-angle t has eigenvalues in the ratio t^2/12 or so: beyond some 25
  // degrees a height field misrepresents it.
  constexpr double kThick = 0.015;
  return scatter.eigenvalues[0] > kThick * scatter.eigenvalues[2];
}

std::optional<AlgebraicCentre>
algebraicCentre(const StartRequest& request, const Eigen::Matrix3d& projector)
{
  const auto& channel = request.points.channel;
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for (int i = 0; i < request.scatter.count; ++i) {
    const Eigen::Vector3d q(channel[0][i], channel[1][i], channel[2][i]);
    Eigen::Vector4d row;
    row << 2.0 * (projector * (q - request.scatter.mean)), 1.0;
    A += row * row.transpose();
    b += row * (0.25 * row.head<3>().squaredNorm());
  }
  // The axis of a cylinder is empty: make it solvable with solution 0 there.
  const double size = A.topLeftCorner<3, 3>().trace();
  A.topLeftCorner<3, 3>() += size * (Eigen::Matrix3d::Identity() - projector);
  const Eigen::FullPivLU<Eigen::Matrix4d> lu(A);
  if (!lu.isInvertible())
    return std::nullopt;
  const Eigen::Vector4d x = lu.solve(b);
  const double radius_squared = x[3] + x.head<3>().squaredNorm();
  if (!(radius_squared > 0.0) || !std::isfinite(radius_squared))
    return std::nullopt;
  return AlgebraicCentre{x.head<3>(), std::sqrt(radius_squared)};
}

UnboundedSurface
surfaceAround(kernel::Model model,
              const AlgebraicCentre& found,
              const Eigen::Vector3d& mean,
              const Eigen::Vector3d& z,
              const Eigen::Vector3d& x)
{
  UnboundedSurface surface;
  surface.model = model;
  // The mean lies on the far side of the centre, seen along z, when the surface is a
  // bowl.
  const double side = found.centre.dot(z) > 0.0 ? 1.0 : -1.0;
  surface.k = {side / found.radius, 0.0, 0.0};
  surface.c = mean + found.centre - side * found.radius * z;
  surface.R.col(2) = z;
  surface.R.col(0) = x;
  surface.R.col(1) = z.cross(surface.R.col(0));
  return surface;
}

namespace {

double
costOf(const UnboundedSurface& surface, const StartRequest& request)
{
  kernel::NormalSums sums;
  kernel::kernel().accumulateNormal(kernel::Precision::Double,
                                    surface.model,
                                    request.residual,
                                    request.points,
                                    kernelState(surface, request.scatter),
                                    sums);
  return std::isfinite(sums.cost) ? sums.cost : std::numeric_limits<double>::max();
}

} // namespace

CheapestStart::CheapestStart(const StartRequest& request, const UnboundedSurface& first)
: request_(request), best_(first), lowest_(costOf(first, request))
{}

void
CheapestStart::consider(const UnboundedSurface& candidate)
{
  const double cost = costOf(candidate, request_);
  if (cost < lowest_) {
    lowest_ = cost;
    best_ = candidate;
  }
}

} // namespace holdfast
