#include <holdfast/fusion/support_grid.h>

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

/// Column or row of a coordinate in radii; outside [0, kCells) beyond the grid.
int
cellOf(double coordinate)
{
  const double cell = (coordinate + SupportGrid::kReach) / SupportGrid::cellSize();
  // Written so that NaN is beyond, too.
  return cell >= 0.0 && cell < SupportGrid::kCells ? static_cast<int>(cell) : -1;
}

} // namespace

bool
SupportGrid::contains(double x, double y) const
{
  const int column = cellOf(x), row = cellOf(y);
  return column >= 0 && row >= 0 && isSet(column, row);
}

void
SupportGrid::mark(double x, double y, double reach)
{
  if (const int column = cellOf(x), row = cellOf(y); column >= 0 && row >= 0)
    set(column, row);
  const auto first = [](double low) {
    return std::max(0, static_cast<int>(std::ceil((low + kReach) / cellSize() - 0.5)));
  };
  for (int row = first(y - reach); row < kCells && middle(row) <= y + reach; ++row)
    for (int column = first(x - reach); column < kCells && middle(column) <= x + reach;
         ++column)
      if (std::hypot(middle(column) - x, middle(row) - y) <= reach)
        set(column, row);
}

void
SupportGrid::add(const SupportGrid& other,
                 const Eigen::Matrix2d& map,
                 const Eigen::Vector2d& offset)
{
  for (int row = 0; row < kCells; ++row)
    for (int column = 0; column < kCells; ++column) {
      const Eigen::Vector2d p =
          map * Eigen::Vector2d(middle(column), middle(row)) + offset;
      if (other.contains(p.x(), p.y()))
        set(column, row);
    }
}

SupportGrid
SupportGrid::fromRows(const std::array<std::uint16_t, kCells>& rows)
{
  SupportGrid grid;
  grid.rows_ = rows;
  return grid;
}

} // namespace holdfast
