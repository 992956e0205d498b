#include "contact/sole.h"

#include "fusion/third_derivatives.h"
#include "geometry/polygon.h"
#include "geometry/symmetric.h"

#include <holdfast/geometry/constants.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace holdfast::contact {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Vector2d;

/// What each number of a shape adds to the height at a place.
Eigen::Matrix<double, 1, kShape>
shapeBasis(const Vector2d& p)
{
  Eigen::Matrix<double, 1, kShape> row;
  row << 0.5 * p.x() * p.x(), p.x() * p.y(), 0.5 * p.y() * p.y(),
      cubicBasis(p.x(), p.y()).transpose();
  return row;
}

Matrix2Xd
columns(const std::vector<Vector2d>& points)
{
  Matrix2Xd matrix(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    matrix.col(static_cast<Eigen::Index>(i)) = points[i];
  return matrix;
}

/// Calls f(place, area) at places which integrate polynomials of fifth degree over a
/// triangle at the origin exactly (Radon 1948), with its orientation as the sign.
template <typename Function>
void
overTriangle(const Vector2d& a, const Vector2d& b, const Function& f)
{
  const double area = 0.5 * (a.x() * b.y() - a.y() * b.x());
  f((a + b) / 3.0, area * 9.0 / 40.0);
  for (const double root : {-std::sqrt(15.0), std::sqrt(15.0)}) {
    const double t = (6.0 + root) / 21.0, weight = area * (155.0 + root) / 1200.0;
    f(t * a + t * b, weight);
    f(t * a + (1.0 - 2.0 * t) * b, weight);
    f((1.0 - 2.0 * t) * a + t * b, weight);
  }
}

/// Coefficients 1, x, y of the plane that is nearest to each term of a shape over the
/// sole, in the mean of squares.
Eigen::Matrix<double, 3, kShape>
bestPlanes(const Foot& foot, Vector2d& centroid)
{
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, kShape> X = Eigen::Matrix<double, 3, kShape>::Zero();
  const double scale = soleReach(foot); // so that the plane's terms are alike
  const auto add = [&](const Vector2d& p, double area) {
    const Eigen::Vector3d b(1.0, p.x() / scale, p.y() / scale);
    M += area * b * b.transpose();
    X += area * b * shapeBasis(p);
  };
  for (std::size_t i = 0; i < foot.sole.size(); ++i)
    overTriangle(foot.sole[i], foot.sole[(i + 1) % foot.sole.size()], add);
  centroid = scale * M.col(0).tail<2>() / M(0, 0);
  Eigen::Matrix<double, 3, kShape> planes = M.ldlt().solve(X);
  planes.bottomRows<2>() /= scale;
  return planes;
}

/// Middles of equal cells within the sole: some fifty, so that a share of it is told to
/// 2 %, and the residual of a quadric in between is known.
Matrix2Xd
cellsOf(const Foot& foot)
{
  constexpr int kCells = 50;
  const Matrix2Xd corners = columns(foot.sole);
  const Vector2d low = corners.rowwise().minCoeff();
  const Vector2d size = corners.rowwise().maxCoeff() - low;
  for (int wanted = kCells;; wanted *= 4) { // a thin slanted sole falls between cells
    const double side = std::sqrt(soleArea(foot) / wanted);
    const int nx = std::max(1, static_cast<int>(std::lround(size.x() / side)));
    const int ny = std::max(1, static_cast<int>(std::lround(size.y() / side)));
    std::vector<Vector2d> inside;
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const Vector2d p =
            low + Vector2d(size.x() * (i + 0.5) / nx, size.y() * (j + 0.5) / ny);
        if (isInside(foot.sole, p))
          inside.push_back(p);
      }
    if (static_cast<int>(inside.size()) >= kCells / 2)
      return columns(inside);
  }
}

Matrix2Xd
extremesOf(const Foot& foot, const Vector2d& centroid)
{
  std::vector<Vector2d> points;
  for (std::size_t i = 0; i < foot.sole.size(); ++i) {
    const Vector2d& next = foot.sole[(i + 1) % foot.sole.size()];
    points.push_back(foot.sole[i]);
    points.emplace_back(0.5 * (foot.sole[i] + next));
  }
  points.push_back(centroid);
  return columns(points);
}

/// Without places where curvatures alone do the same as at an earlier one, as at
/// opposite corners of a rectangle.
Matrix2Xd
withoutRepeated(const SolePlaces& all)
{
  std::vector<Vector2d> kept;
  std::vector<Eigen::RowVector4d> seen;
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    Eigen::RowVector4d row;
    row << all.rows.row(i).head<3>(), all.own[i];
    bool is_new = true;
    for (const Eigen::RowVector4d& other : seen)
      is_new = is_new && (row - other).norm() > 1e-9 * row.norm();
    if (!is_new)
      continue;
    seen.push_back(row);
    kept.emplace_back(all.places.col(i));
  }
  return columns(kept);
}

} // namespace

Sole::Sole(const Foot& foot) : foot_(foot)
{
  if (const std::string error = validityError(foot); !error.empty())
    throw std::invalid_argument(error);
  area_ = soleArea(foot);
  Vector2d centroid;
  planes_ = bestPlanes(foot, centroid);
  cells_ = placesAt(cellsOf(foot));
  extremes_ = placesAt(extremesOf(foot, centroid));
  even_extremes_ = placesAt(withoutRepeated(extremes_));
}

SolePlaces
Sole::placesAt(const Matrix2Xd& places) const
{
  SolePlaces result{places, ShapeRows(places.cols(), kShape), {}};
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const Vector2d p = places.col(i);
    result.rows.row(i) =
        shapeBasis(p) - Eigen::RowVector3d(1.0, p.x(), p.y()) * planes_;
  }
  ShapeVector own = ShapeVector::Zero();
  own[0] = foot_.curvature.x();
  own[2] = foot_.curvature.y();
  result.own = result.rows * own;
  return result;
}

Sole
Sole::turned(double angle) const
{
  Sole result = *this;
  result.turn_ += angle;
  const Eigen::Matrix2d W = Eigen::Rotation2Dd(angle).toRotationMatrix();
  for (SolePlaces* all : {&result.cells_, &result.extremes_, &result.even_extremes_}) {
    all->places = W * all->places;
    all->rows = turnedRows(all->rows, angle);
  }
  return result;
}

std::vector<Sole>
inAllDirections(const Sole& sole, int yaws)
{
  std::vector<Sole> all;
  for (int i = 0; i < yaws; ++i)
    all.push_back(sole.turned(2.0 * kPi * i / yaws));
  return all;
}

ShapeRows
turnedRows(const ShapeRows& rows, double angle)
{
  Eigen::Matrix2d W; // axes of the sole as columns
  W << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  ShapeMatrix turn = ShapeMatrix::Zero();
  turn.topLeftCorner<3, 3>() = symmetric::planeTurn(Eigen::Matrix2d(W.transpose()));
  turn.bottomRightCorner<4, 4>() = turnOfThird(W);
  return rows * turn;
}

} // namespace holdfast::contact
