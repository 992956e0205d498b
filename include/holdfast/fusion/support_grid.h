/// \file Where a patch was seen: a small raster over the plane of its anchor.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>

namespace holdfast {

/// 16 x 16 cells over [-1.5, 1.5] radii about the anchor's origin; row by row in y.
class SupportGrid {
public:
  static constexpr int kCells = 16;
  static constexpr double kReach = 1.5; ///< in radii

  /// Side of a cell over the radius.
  static constexpr double cellSize()
  {
    return 2.0 * kReach / kCells;
  }

  /// Middle of a column or row, in radii.
  static constexpr double middle(int index)
  {
    return (index + 0.5) * cellSize() - kReach;
  }

  bool isSet(int column, int row) const
  {
    return (rows_[static_cast<std::size_t>(row)] >> column & 1U) != 0;
  }

  void set(int column, int row)
  {
    rows_[static_cast<std::size_t>(row)] |= static_cast<std::uint16_t>(1U << column);
  }

  /// True where a cell that was hit has the point; x and y in radii.
  bool contains(double x, double y) const;

  /// Marks the cells whose middle is within `reach` of (x, y), and the one it lies in;
  /// all in radii.
  void mark(double x, double y, double reach);

  /// Adds the cells whose middle lies in a hit cell of another grid, which sees a point
  /// p of this one's plane at map * p + offset; all in the other's and this one's
  /// radii.
  void add(const SupportGrid& other,
           const Eigen::Matrix2d& map,
           const Eigen::Vector2d& offset);

  const std::array<std::uint16_t, kCells>& rows() const
  {
    return rows_;
  }
  static SupportGrid fromRows(const std::array<std::uint16_t, kCells>& rows);

private:
  std::array<std::uint16_t, kCells> rows_ = {};
};

} // namespace holdfast
