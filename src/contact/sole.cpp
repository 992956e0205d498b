#include "contact/sole.h"

#include "fusion/third_derivatives.h"
#include "geometry/symmetric.h"

#include <Eigen/Cholesky>

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

/// By the number of edges that a ray along x crosses.
bool
isInside(const std::vector<Vector2d>& corners, const Vector2d& p)
{
  bool inside = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Vector2d &a = corners[i], &b = corners[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()))
      inside = !inside;
  }
  return inside;
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
    // Three cells off a line tell a plane; half of those asked for are enough of them.
    if (static_cast<int>(inside.size()) >= kCells / 2)
      return columns(inside);
  }
}

Matrix2Xd
extremesOf(const Foot& foot, const Matrix2Xd& cells)
{
  std::vector<Vector2d> points;
  for (std::size_t i = 0; i < foot.sole.size(); ++i) {
    const Vector2d& next = foot.sole[(i + 1) % foot.sole.size()];
    points.push_back(foot.sole[i]);
    points.emplace_back(0.5 * (foot.sole[i] + next));
  }
  points.emplace_back(cells.rowwise().mean());
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
  const Matrix2Xd cells = cellsOf(foot);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, kShape> X = Eigen::Matrix<double, 3, kShape>::Zero();
  const double scale = soleReach(foot); // the plane's terms in like units
  for (const Vector2d p : cells.colwise()) {
    const Eigen::Vector3d b(1.0, p.x() / scale, p.y() / scale);
    M += b * b.transpose();
    X += b * shapeBasis(p);
  }
  planes_ = M.ldlt().solve(X);
  planes_.bottomRows<2>() /= scale;
  cells_ = placesAt(cells);
  extremes_ = placesAt(extremesOf(foot, cells));
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
