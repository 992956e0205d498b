/// \file The sole as the places at which the surface is compared with it.
#pragma once

#include <holdfast/contact/foot.h>

#include <Eigen/Core>

#include <vector>

namespace holdfast::contact {

/// What of a surface shows under a sole: [kxx kxy kyy | xxx xxy xyy yyy], its second
/// and third derivatives in the load's frame. Height and slope do not: the sole
/// follows.
inline constexpr int kShape = 7;
using ShapeVector = Eigen::Matrix<double, kShape, 1>;
using ShapeMatrix = Eigen::Matrix<double, kShape, kShape>;
using ShapeRows = Eigen::Matrix<double, Eigen::Dynamic, kShape, Eigen::RowMajor>;

/// Places of the sole and how far the surface is off it there, once the sole lies on
/// the surface as the plane through it does that has the least mean square: residual =
/// rows * shape - own.
struct SolePlaces {
  Eigen::Matrix2Xd places; ///< m
  ShapeRows rows;
  Eigen::VectorXd own; ///< of the sole itself, m

  Eigen::Index size() const
  {
    return own.size();
  }
};

/// What does not depend on where a foot is put, in one direction.
class Sole {
public:
  /// \throw std::invalid_argument when the foot makes no sense.
  explicit Sole(const Foot& foot);

  /// The same, turned by an angle about the load: places and rows are in the axes from
  /// which it is turned, rows for shapes in those axes.
  Sole turned(double angle) const;

  /// By how much it was turned, rad.
  double turn() const
  {
    return turn_;
  }

  const Foot& foot() const
  {
    return foot_;
  }

  /// Even cells, each of the same area.
  const SolePlaces& cells() const
  {
    return cells_;
  }

  /// Where a surface is farthest off: corners, middles of edges and of the sole. Those
  /// that any surface is off by as much as at another, but for the sign, are left out
  /// of the rows only if it has no third derivatives (`even`).
  const SolePlaces& extremes(bool even) const
  {
    return even ? even_extremes_ : extremes_;
  }

  double area() const
  {
    return area_;
  }

private:
  SolePlaces placesAt(const Eigen::Matrix2Xd& places) const;

  Foot foot_;
  double area_ = 0.0, turn_ = 0.0;
  Eigen::Matrix<double, 3, kShape> planes_; ///< nearest to each term of a shape
  SolePlaces cells_, extremes_, even_extremes_;
};

/// Rows for shapes in axes from which those of the sole are turned by an angle.
ShapeRows turnedRows(const ShapeRows& rows, double angle);

/// A sole in so many directions over a full turn, the first as it is.
std::vector<Sole> inAllDirections(const Sole& sole, int yaws);

} // namespace holdfast::contact
