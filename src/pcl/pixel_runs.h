/// \file Connected pixels by runs: one pass over the pixels, one comparison each; whole
/// runs are joined where rows meet.
#pragma once

#include "pixel_grid.h"

#include <cstddef>
#include <vector>

namespace holdfast {

/// Values over the pixels of a window; row(v)[u] is that of pixel (u, v). Pixels that
/// are NaN belong to nothing.
struct PixelRows {
  const float* first; ///< row(v) = first + v stride; only rows of the window are read
  std::ptrdiff_t stride;

  const float* row(int v) const
  {
    return first + v * stride;
  }
};

/// Connected pixels [begin, end) of one row; runs that touch form a tree by `parent`.
struct Run {
  int row;
  int begin;
  int end;
  int parent;
};

/// Kept between searches: no allocation once it has seen the largest.
struct RunMemory {
  std::vector<Run> runs;
  std::vector<char> continues; ///< of a row
};

/// Largest difference of values between neighbours that belong together.
struct PixelJump {
  float in_row;
  float across_rows;
};

/// Collects the runs of rows from the first to the last, then the component of a seed.
class PixelRuns {
public:
  PixelRuns(const PixelRows& values, const PixelJump& jump, RunMemory& memory)
  : values_(values), jump_(jump), runs_(memory.runs), continues_(memory.continues)
  {
    runs_.clear();
  }

  /// The runs within a range of columns of the row below the last.
  void addRow(int row, PixelRange columns);

  /// Indices, in an image of this width, of the pixels connected to that one
  /// (4-neighbours), ascending; none when it is in no run.
  void component(int u, int v, int image_width, std::vector<int>& indices);

private:
  int rootOf(int i);
  bool touch(const Run& a, const Run& b) const;
  void joinRows(int above, int here);

  PixelRows values_;
  PixelJump jump_;
  std::vector<Run>& runs_;
  std::vector<char>& continues_; ///< whether pixels go on where those before them are
  int above_ = 0; ///< where the runs of the last row begin
};

} // namespace holdfast
