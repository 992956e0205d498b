/// \file How much of a patch the points of its neighbourhood support (as in SPL:
/// Kanoulas & Vona, ICRA 2013).
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/patch/patch.h>

#include <Eigen/Core>

#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// The box around the boundary in the local xy plane is cut into equal cells; a cell is
/// covered when its part within the boundary holds enough points.
struct CoverageOptions {
  /// Side of a cell, m; by default such that the average cell holds points_per_cell
  /// points. A patch is cut into 32 x 32 cells at most, and into whole ones.
  std::optional<double> cell_size_m;
  /// Points expected in a cell of cell_size_m; without that size, points that the
  /// average cell shall hold. On a surface seen obliquely the rows of pixels are
  /// 1/cos(tilt) farther apart than the columns, and a square of eight pixels is
  /// sqrt(8 cos(tilt)) rows high: more than one up to 80 degrees, so that no cell falls
  /// between two rows.
  double points_per_cell = 8.0;
  /// Share of the points expected in its part within the boundary that covers a cell.
  /// Where a curved patch turns away from the sensor, points are two to three times
  /// sparser than on average, and that is no hole.
  double min_fill = 1.0 / 3.0;
  /// A cell with more points than this share of a whole cell's outside the boundary is
  /// not covered. A surface that simply goes on puts at most half there, as only cells
  /// that lie within by half or more are judged.
  double max_spill = 1.0;
};

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const CoverageOptions& options);

struct Coverage {
  /// Covered area over judged area, 0 to 1. Cells of which only a sliver lies within
  /// the boundary (less than half as much as of the fullest cell) are not judged.
  double share = 0.0;
  int cells = 0; ///< judged
  int covered_cells = 0;
  int points_inside = 0; ///< projected within the boundary
  int points_outside = 0; ///< finite, but not within
};

/// How much of a valid patch its points cover, whatever their distance from the
/// surface. Takes no memory from the heap.
/// \throw std::invalid_argument when the options make no sense.
Coverage measureCoverage(const Patch& patch,
                         const PointBatch& points,
                         const CoverageOptions& options = {});

/// \param points in world coordinates; those that are not finite are left out.
Coverage measureCoverage(const Patch& patch,
                         const std::vector<Eigen::Vector3d>& points,
                         const CoverageOptions& options = {});

} // namespace holdfast
