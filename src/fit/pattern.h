/// \file Errors that points share, summed over a patch.
///
/// With y_i = (X_i r_i, D_i r_i), 15 numbers that tell how the surface's gradient and
/// the moments move with the shared error of point i (fit/kernel.h, surface_fit.h), the
/// pattern adds
///
///     sum_{i != j} y_i C(u_i - u_j) y_j^T
///
/// to what independent errors of the same size give. Components of the pattern
/// (CorrelatedNoise) much shorter than a patch are met in a point's neighbourhood: they
/// are extra variance of the point along r_i, once for each of its neighbours, in the
/// sums of the covariance but not in the weights. Longer ones are summed over pairs of
/// cells of a grid over the patch, with their mean over both cells.
#pragma once

#include "kernel.h"
#include <holdfast/fit/point_batch.h>

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace holdfast {

/// y of a cell: X_i r_i (6), D_i r_i for mean (3) and scatter xx xy xz yy yz zz (6).
inline constexpr int kPatternTerms = kernel::kMaxTheta + 9;
using PatternMatrix =
    Eigen::Matrix<double, kPatternTerms, kPatternTerms, Eigen::DontAlign>;

/// Numbers of the points of a batch, as the kernel wants them; memory is kept between
/// uses.
class PaddedRows {
public:
  /// What is written, zero or not, is left to the caller.
  void resize(int rows, int padded_size)
  {
    lines_per_row_ = static_cast<std::size_t>(padded_size / PointBatch::kLaneMultiple);
    lines_.resize(static_cast<std::size_t>(rows) * lines_per_row_);
  }

  double* row(int i)
  {
    return lines_[static_cast<std::size_t>(i) * lines_per_row_].value;
  }

private:
  struct alignas(64) Line {
    double value[PointBatch::kLaneMultiple] = {};
  };
  std::vector<Line> lines_;
  std::size_t lines_per_row_ = 0;
};

/// How the points of a patch lie in the image, and the cells over them.
class PatternSupport {
public:
  PatternSupport() = default;

  /// Measures the support of a padded batch that has a pattern, and writes its channel
  /// EXTRA.
  explicit PatternSupport(PointBatch& batch);

  /// The cells over the points.
  kernel::CellGrid grid() const
  {
    return {{u0_, v0_}, 1.0 / side_px_};
  }

  /// In which of them a pixel lies.
  int cellOf(double u, double v) const
  {
    const kernel::CellGrid cells = grid();
    const auto along = [&](double from_corner) {
      const double sides = from_corner * cells.inverse_side;
      return static_cast<int>(std::clamp(sides, 0.0, kernel::kCells - 1.0));
    };
    return kernel::kCells * along(v - v0_) + along(u - u0_);
  }

  /// The pattern's share in the gradient's and the moments' covariance, what EXTRA
  /// stands for not included.
  /// \param cells sums of y_i, of which the covariance is added.
  PatternMatrix sum(const CorrelatedNoise& noise,
                    kernel::Precision precision,
                    kernel::CellSums& cells) const;

private:
  bool isShort(const CorrelatedNoise::Component& wave) const;
  void writeCovariance(const CorrelatedNoise& noise, kernel::CellSums& cells) const;
  void writeExtra(const kernel::Points& points, PointBatch& batch) const;

  double u0_ = 0.0, v0_ = 0.0; ///< corner of the grid, px
  double side_px_ = 1.0; ///< of a cell
  double spacing_px_ = 1.0; ///< of the points, as if on a square lattice
  /// Uniform ellipse with the pixels' mean and second moments: its centre, and the
  /// matrix that makes it the unit disc.
  Eigen::Vector2d mean_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d to_disc_ = Eigen::Matrix2d::Identity();
  double radius_px_ = 1.0; ///< geometric mean of its semi-axes
};

} // namespace holdfast
