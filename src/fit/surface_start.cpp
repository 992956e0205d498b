#include "fit/surface_start.h"

#include <holdfast/geometry/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
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
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> cholesky(A);
  constexpr double kSmallestPivot = 1e-5; // square root of the solver's pivot tolerance
  if (cholesky.info() != Eigen::Success ||
      cholesky.matrixLLT().diagonal().minCoeff() < kSmallestPivot)
    return {};
  const Eigen::Matrix<double, 6, 1> x =
      scale.cwiseProduct(cholesky.solve(scale.cwiseProduct(b)));
  return {x[0], {x[1], x[2]}, {2.0 * x[3], x[4], 2.0 * x[5]}};
}

namespace {

using kernel::Model;

// The frame of the quadric where the line along the principal normal meets it.
UnboundedSurface
surfaceFromQuadric(Model model, const Quadric& quadric, const Scatter& scatter)
{
  UnboundedSurface surface;
  surface.model = model;
  surface.a = quadric.a0;
  surface.c = scatter.mean + surface.a * scatter.normal();
  const double stretch = std::sqrt(1.0 + quadric.slope.squaredNorm());
  const Eigen::Vector3d up =
      Eigen::Vector3d(-quadric.slope.x(), -quadric.slope.y(), 1.0) / stretch;
  const Eigen::Vector2d tilt = rxyFromNormal(up);
  surface.R = scatter.axes * expMap({tilt.x(), tilt.y(), 0.0});
  surface.k = quadric.k / stretch;
  if (model == Model::Sphere)
    surface.k = {0.5 * (surface.k[0] + surface.k[2]), 0.0, 0.0};
  return surface;
}

// Turns the frame about z so that x is the direction of the smaller |curvature|.
void
alignCylinder(UnboundedSurface& surface)
{
  Eigen::Matrix2d K;
  K << surface.k[0], surface.k[1], surface.k[1], surface.k[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(K);
  const Eigen::Vector2d values = solver.eigenvalues();
  const int straight = std::abs(values[0]) < std::abs(values[1]) ? 0 : 1;
  const Eigen::Vector2d x = solver.eigenvectors().col(straight);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << x.x(), -x.y(), x.y(), x.x();
  surface.R = surface.R * turn;
  surface.k = {values[1 - straight], 0.0, 0.0};
}

// Sphere or, in the plane normal to `axis`, circle by algebraic least squares (Kasa):
// |q|^2 = 2 centre.q + e. Empty directions (the axis) are left out.
struct AlgebraicCentre {
  bool found = false;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); // relative to the mean
  double radius = 0.0;
};

AlgebraicCentre
algebraicCentre(const kernel::Points& points,
                const Scatter& scatter,
                const Eigen::Matrix3d& projector)
{
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for (int i = 0; i < scatter.count; ++i) {
    const Eigen::Vector3d q(points.channel[0][i],
                            points.channel[1][i],
                            points.channel[2][i]);
    Eigen::Vector4d row;
    row << 2.0 * (projector * (q - scatter.mean)), 1.0;
    A += row * row.transpose();
    b += row * (0.25 * row.head<3>().squaredNorm());
  }
  // The axis of a cylinder is empty: make it solvable with solution 0 there.
  const double size = A.topLeftCorner<3, 3>().trace();
  A.topLeftCorner<3, 3>() += size * (Eigen::Matrix3d::Identity() - projector);
  const Eigen::FullPivLU<Eigen::Matrix4d> lu(A);
  AlgebraicCentre result;
  if (!lu.isInvertible())
    return result;
  const Eigen::Vector4d x = lu.solve(b);
  const double radius_squared = x[3] + x.head<3>().squaredNorm();
  result.found = radius_squared > 0.0 && std::isfinite(radius_squared);
  result.centre = x.head<3>();
  result.radius = result.found ? std::sqrt(radius_squared) : 0.0;
  return result;
}

// The surface with its frame where the principal normal, from the centre, leaves it;
// the side on which the points are decides the sign of the curvature.
UnboundedSurface
surfaceFromCentre(Model model,
                  const AlgebraicCentre& found,
                  const Scatter& scatter,
                  const Eigen::Vector3d& axis)
{
  UnboundedSurface surface;
  surface.model = model;
  Eigen::Vector3d z = scatter.normal();
  if (model == Model::Cylinder)
    z -= axis * axis.dot(z);
  z.normalize();
  // The mean lies on the far side of the centre, seen along z, when the surface is a
  // bowl.
  const double side = found.centre.dot(z) > 0.0 ? 1.0 : -1.0;
  surface.k = {side / found.radius, 0.0, 0.0};
  surface.c = scatter.mean + found.centre - side * found.radius * z;
  surface.R.col(2) = z;
  surface.R.col(0) = model == Model::Cylinder ? axis : frameFromZ(z).col(0);
  surface.R.col(1) = z.cross(surface.R.col(0));
  return surface;
}

double
costOf(const UnboundedSurface& surface,
       Residual residual,
       const kernel::Points& points,
       const Scatter& scatter)
{
  kernel::NormalSums sums;
  kernel::kernel().accumulateNormal(surface.model,
                                    residual,
                                    points,
                                    kernelState(surface, scatter),
                                    sums);
  return std::isfinite(sums.cost) ? sums.cost : std::numeric_limits<double>::max();
}

// Replaces `best` by an algebraic fit where that costs less.
void
tryAlgebraicStarts(Residual residual,
                   const kernel::Points& points,
                   const Scatter& scatter,
                   UnboundedSurface& best)
{
  const bool cylinder = best.model == Model::Cylinder;
  double lowest = costOf(best, residual, points, scatter);
  for (int i = 0; i < (cylinder ? 3 : 1); ++i) {
    const Eigen::Vector3d axis = scatter.axes.col(i);
    // An axis along the normal leaves no direction for z.
    if (cylinder && i == 2)
      continue;
    const Eigen::Matrix3d projector =
        cylinder ?
            Eigen::Matrix3d(Eigen::Matrix3d::Identity() - axis * axis.transpose()) :
            Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    const AlgebraicCentre found = algebraicCentre(points, scatter, projector);
    if (!found.found || !(found.radius > 0.0))
      continue;
    const UnboundedSurface candidate =
        surfaceFromCentre(best.model, found, scatter, axis);
    const double cost = costOf(candidate, residual, points, scatter);
    if (cost < lowest) {
      lowest = cost;
      best = candidate;
    }
  }
}

} // namespace

bool
isThick(Model model, const Scatter& scatter)
{
  // A cap of half-angle t has eigenvalues in the ratio t^2/12 or so: beyond some 25
  // degrees a height field misrepresents it.
  constexpr double kThick = 0.015;
  return (model == Model::Sphere || model == Model::Cylinder) &&
         scatter.eigenvalues[0] > kThick * scatter.eigenvalues[2];
}

UnboundedSurface
surfaceStart(Model model,
             Residual residual,
             const kernel::Points& points,
             const Scatter& scatter)
{
  UnboundedSurface surface;
  surface.model = model;
  surface.R = scatter.axes;
  surface.c = scatter.mean;
  if (model == Model::Plane)
    return surface;
  surface = surfaceFromQuadric(model, leastSquaresQuadric(points, scatter), scatter);
  if (model == Model::Cylinder)
    alignCylinder(surface);
  if (isThick(model, scatter))
    tryAlgebraicStarts(residual, points, scatter, surface);
  return surface;
}

} // namespace holdfast
