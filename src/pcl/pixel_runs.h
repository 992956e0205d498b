/// \file Connected pixels by runs: one pass over the pixels, one comparison each; whole
/// runs are joined where rows meet.
#pragma once

#include "pixel_vectors.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace holdfast {

/// Connected pixels [begin, end) of one row; runs that touch form a tree by `parent`.
struct Run {
  int row;
  int begin;
  int end;
  int parent;
};

/// Bits of one row, the first of which is of that column.
struct BitRow {
  const std::uint64_t* words;
  int first_column;

  /// The first column of [begin, end) whose bit is set, or clear; `end` without one.
  int firstSet(int begin, int end) const;
  int firstClear(int begin, int end) const;
};

/// Kept between searches: no allocation once it has seen the largest.
struct RunMemory {
  std::vector<Run> runs;
  std::vector<std::uint64_t> bits; ///< of a row
};

/// Collects the runs of rows from the first to the last, then the component of a seed.
class PixelRuns {
public:
  PixelRuns(const PixelRows& values, const PixelJump& jump, RunMemory& memory)
  : values_(values), jump_(jump), runs_(memory.runs), bits_(memory.bits)
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
  void joinRows(int above, int here, const BitRow& touches);

  PixelRows values_;
  PixelJump jump_;
  std::vector<Run>& runs_;
  std::vector<std::uint64_t>& bits_;
  bool is_first_ = true;
  int above_ = 0; ///< where the runs of the last row begin
};

} // namespace holdfast
