#include <holdfast/patch/boundary.h>
#include <holdfast/validation/coverage.h>

#include "local_points.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

// The smallest box around the boundary: its corners, or where an ellipse meets its
// axes, are where the sides begin.
Eigen::AlignedBox2d
boundingBox(const Patch& patch)
{
  Eigen::AlignedBox2d box;
  for (int side = 0; side < 4; ++side)
    box.extend(boundaryPoint(patch, side));
  return box;
}

// The box around a patch in equal cells, as nearly square as they can be.
class CellGrid {
public:
  CellGrid(const Patch& patch, const Eigen::AlignedBox2d& box, double wanted_cells)
  : boundary_(patch), box_(box)
  {
    const Eigen::Vector2d size = box.sizes();
    columns_ = lineCount(wanted_cells, size.x() / size.y());
    rows_ = lineCount(wanted_cells, size.y() / size.x());
    cell_size_ = size.cwiseQuotient(Eigen::Vector2d(columns_, rows_));
    cells_per_m_ = cell_size_.cwiseInverse();
    samples_per_side_ = std::max(4, 16 / std::max(columns_, rows_));
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        at(column, row) = {samplesWithin(column, row), 0, 0};
  }

  void add(double x, double y, bool inside)
  {
    ++(inside ? points_inside_ : points_outside_);
    const double column = (x - box_.min().x()) * cells_per_m_.x();
    const double row = (y - box_.min().y()) * cells_per_m_.y();
    const bool in_box =
        column >= 0.0 && row >= 0.0 && column <= columns_ && row <= rows_;
    if (!inside && !in_box)
      return;
    // The upper edge of the box, and what is beyond by rounding, are in the last cell.
    Cell& cell = at(std::clamp(static_cast<int>(column), 0, columns_ - 1),
                    std::clamp(static_cast<int>(row), 0, rows_ - 1));
    ++(inside ? cell.inside : cell.outside);
  }

  Coverage evaluate(const CoverageOptions& options) const
  {
    const double expected = expectedPerCell(options);
    int most_samples = 0;
    for (const Cell& cell : *this)
      most_samples = std::max(most_samples, cell.samples);
    Coverage coverage;
    coverage.points_inside = points_inside_;
    coverage.points_outside = points_outside_;
    int judged = 0, covered = 0; // samples
    for (const Cell& cell : *this) {
      if (2 * cell.samples < most_samples)
        continue;
      ++coverage.cells;
      judged += cell.samples;
      if (cell.inside == 0 ||
          cell.inside < options.min_fill * expected * cellShare(cell.samples) ||
          cell.outside > options.max_spill * expected)
        continue;
      ++coverage.covered_cells;
      covered += cell.samples;
    }
    coverage.share = static_cast<double>(covered) / std::max(judged, 1);
    return coverage;
  }

private:
  struct Cell {
    int samples; // of its area, within the boundary
    int inside; // points
    int outside;
  };

  static constexpr int kMostLines = 32;

  static int lineCount(double wanted_cells, double aspect)
  {
    // A strip narrower than a cell is cut across only.
    const double lines = std::min(std::sqrt(wanted_cells * aspect), wanted_cells);
    return static_cast<int>(std::clamp(std::round(lines), 1.0, double(kMostLines)));
  }

  // Cells in use.
  const Cell* begin() const
  {
    return cells_.data();
  }
  const Cell* end() const
  {
    return cells_.data() + columns_ * rows_;
  }

  Cell& at(int column, int row)
  {
    return cells_[static_cast<std::size_t>(row * columns_ + column)];
  }

  double cellShare(int samples) const
  {
    return static_cast<double>(samples) / (samples_per_side_ * samples_per_side_);
  }

  int samplesWithin(int column, int row) const
  {
    const int n = samples_per_side_;
    const auto isWithin = [&](int i, int j) {
      const double x = box_.min().x() + (column + (i + 0.5) / n) * cell_size_.x();
      const double y = box_.min().y() + (row + (j + 0.5) / n) * cell_size_.y();
      return boundary_.contains(x, y);
    };
    // Boundaries are convex: when the corners are within, so is all between.
    const int last = n - 1;
    if (isWithin(0, 0) && isWithin(last, 0) && isWithin(0, last) &&
        isWithin(last, last))
      return n * n;
    int within = 0;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        within += isWithin(i, j);
    return within;
  }

  // Points expected in a whole cell; without a size to which the options refer, the
  // mean over the cells that hold any, as an empty half must not halve what is expected
  // of the other.
  double expectedPerCell(const CoverageOptions& options) const
  {
    if (options.cell_size_m)
      return options.points_per_cell * (cell_size_ / *options.cell_size_m).prod();
    int samples = 0;
    for (const Cell& cell : *this)
      samples += cell.inside > 0 ? cell.samples : 0;
    return points_inside_ / cellShare(std::max(samples, 1));
  }

  BoundaryForm boundary_;
  Eigen::AlignedBox2d box_;
  Eigen::Vector2d cell_size_, cells_per_m_;
  int columns_, rows_;
  int samples_per_side_;
  int points_inside_ = 0, points_outside_ = 0;
  // On the stack; only those in use are set.
  std::array<Cell, kMostLines * kMostLines> cells_;
};

double
wantedCells(const Eigen::AlignedBox2d& box,
            const LocalPoints& points,
            const CoverageOptions& options)
{
  if (options.cell_size_m)
    return (box.sizes() / *options.cell_size_m).prod();
  int in_box = 0;
  const double left = box.min().x(), right = box.max().x();
  const double low = box.min().y(), high = box.max().y();
  const double *x = points.x(), *y = points.y();
  // Without branches, so that several points are looked at at once.
  for (int i = 0; i < points.size(); ++i)
    in_box += (x[i] >= left) & (x[i] <= right) & (y[i] >= low) & (y[i] <= high);
  return in_box / options.points_per_cell;
}

} // namespace

std::string
validityError(const CoverageOptions& options)
{
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  if (options.cell_size_m && !positive(*options.cell_size_m))
    return "cell_size_m must be a positive number";
  if (!positive(options.points_per_cell))
    return "points_per_cell must be a positive number";
  if (!(options.min_fill >= 0.0 && options.min_fill <= 1.0))
    return "min_fill must lie between 0 and 1";
  if (!(options.max_spill >= 0.0))
    return "max_spill must not be negative";
  return {};
}

Coverage
coverageOf(const Patch& patch,
           const LocalPoints& points,
           const CoverageOptions& options)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument(error);
  const Eigen::AlignedBox2d box = boundingBox(patch);
  CellGrid grid(patch, box, wantedCells(box, points, options));
  for (int i = 0; i < points.size(); ++i)
    grid.add(points.x()[i], points.y()[i], points.isInside(i));
  return grid.evaluate(options);
}

Coverage
measureCoverage(const Patch& patch,
                const PointBatch& points,
                const CoverageOptions& options)
{
  return coverageOf(patch, LocalPoints(patch, points), options);
}

Coverage
measureCoverage(const Patch& patch,
                const std::vector<Eigen::Vector3d>& points,
                const CoverageOptions& options)
{
  return coverageOf(patch, LocalPoints(patch, points), options);
}

} // namespace holdfast
