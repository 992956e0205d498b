// Points that share errors (fit/pattern.h), for any number type. Included by
// kernel_point.inl.

HOLDFAST_INLINE Number
smaller(Number a, Number b)
{
  return selectLess(a, b, a, b);
}

inline void
accumulatePixels(const Points& points, const double about[2], PixelSums& out)
{
  const double* const* pixel = points.pattern->pixel;
  Number low[2], high[2], sum[2], squares[3];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 2; ++k) {
    low[k] = high[k] = Number(pixel[k][0]);
    sum[k] = Number(0.0);
  }
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 3; ++e)
    squares[e] = Number(0.0);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    const Number weight = load(points.channel[9] + i);
    Number from[2];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 2; ++k) {
      const Number at = load(pixel[k] + i);
      low[k] = smaller(low[k], at);
      high[k] = larger(high[k], at);
      from[k] = (at - about[k]) * weight;
      sum[k] = sum[k] + from[k];
    }
    squares[0] = squares[0] + from[0] * from[0];
    squares[1] = squares[1] + from[0] * from[1];
    squares[2] = squares[2] + from[1] * from[1];
  }
  for (int k = 0; k < 2; ++k) {
    alignas(64) double lanes[kLanes];
    store(low[k], lanes);
    out.low[k] = *std::min_element(lanes, lanes + kLanes);
    store(high[k], lanes);
    out.high[k] = *std::max_element(lanes, lanes + kLanes);
    out.sum[k] = sumOfLanes(sum[k]);
  }
  for (int e = 0; e < 3; ++e)
    out.squares[e] = sumOfLanes(squares[e]);
}

// A point has a half of its neighbours at the edge, and as much less than all in the
// mean as a half-plane lacks.
inline void
neighborVariances(const Points& points, const NeighborVariance& neighbors, double* out)
{
  const double* const* pixel = points.pattern->pixel;
  const double *m = neighbors.middle, *T = neighbors.to_disc;
  const Number zero(0.0);
  const double per_radius = neighbors.edge > 0.0 ? 1.0 / neighbors.edge : 0.0;
  const double half = neighbors.edge > 0.0 ? 0.5 : 0.0;
  for (int i = 0; i < points.padded_size; i += kLanes) {
    const Number u = load(pixel[0] + i) - m[0], v = load(pixel[1] + i) - m[1];
    const Number x = u * T[0], y = u * T[1] + v * T[2];
    const Number inside = larger(zero, 1.0 - squareRoot(x * x + y * y));
    const Number lack = larger(zero, 1.0 - inside * per_radius);
    store((1.0 - lack * lack * half) * neighbors.whole - neighbors.less, out + i);
  }
}

// Of a cell, along one direction; pixels beyond all reason are in some cell, too.
HOLDFAST_INLINE Number
cellAlong(Number pixel, double corner, double inverse_side)
{
  const Number last(kCells - 1.0);
  return larger(Number(0.0), smaller((pixel - corner) * inverse_side, last));
}

// y_i of kLanes points, four by four.
HOLDFAST_INLINE void
writeCellTerms(const Points& points,
               const MomentFrame& frame,
               int i,
               double y[kCellRow / 4][4 * kLanes])
{
  const PatternPoints& pattern = *points.pattern;
  Number term[kCellRow], offset[3], direction[3], q[3];
  HOLDFAST_UNROLLED_FOR (int a = 0; a < kMaxTheta; ++a)
    term[a] = load(pattern.response + a * points.padded_size + i);
  Number* r = term + kMaxTheta;
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
    offset[k] = load(points.channel[k] + i) - frame.mean[k];
    direction[k] = load(pattern.direction[k] + i) * frame.scale;
  }
  rotateIntoFrame(frame.R, offset, q);
  rotateIntoFrame(frame.R, direction, r);
  Number* moment = r + 3;
  HOLDFAST_UNROLLED_FOR (int b = 0, entry = 0; b < 3; ++b)
    HOLDFAST_UNROLLED_FOR (int c = b; c < 3; ++c, ++entry)
      moment[entry] = q[b] * r[c] + q[c] * r[b];
  term[kCellRow - 1] = Number(0.0);
  HOLDFAST_UNROLLED_FOR (int k = 0; k < kCellRow; k += 4)
    storeByLane(term + k, y[k / 4]);
}

inline void
sumInCells(const Points& points,
           const MomentFrame& frame,
           const CellGrid& grid,
           CellSums& cells)
{
  const double* const* pixel = points.pattern->pixel;
  alignas(64) double y[kCellRow / 4][4 * kLanes], column[kLanes], row[kLanes];
  for (int i = 0; i < points.padded_size; i += kLanes) {
    writeCellTerms(points, frame, i, y);
    store(cellAlong(load(pixel[0] + i), grid.corner[0], grid.inverse_side), column);
    store(cellAlong(load(pixel[1] + i), grid.corner[1], grid.inverse_side), row);
    for (int lane = 0; lane < kLanes; ++lane) {
      double* cell =
          cells
              .y[static_cast<int>(row[lane]) * kCells + static_cast<int>(column[lane])];
      HOLDFAST_UNROLLED_FOR (int k = 0; k < kCellRow; k += 4)
        addFour(y[k / 4] + 4 * lane, cell + k);
    }
  }
}

// ---- Sums over the cells of a grid --------------------------------------------------
//
// C does not change when both cells are mirrored, so that what is even about a middle
// line of the grid and what is odd have no covariance: four sums over a quarter of the
// cells, each with itself, in place of one over all pairs.

constexpr int kHalf = kCells / 2;
constexpr int kQuarter = kHalf * kHalf;
constexpr int kRowNumbers = kCellRow / kLanes;

// Of the quarter: even (0) or odd (1) about the middle row, then about the column.
using FoldedCells = double[2][2][kQuarter][kCellRow];
using FoldedCovariance = double[2][2][kQuarter][kQuarter];

HOLDFAST_INLINE void
foldCells(const CellSums& cells, FoldedCells& folded)
{
  for (int row = 0; row < kHalf; ++row)
    for (int column = 0; column < kHalf; ++column) {
      const int mirrored = kCells - 1 - column, below = kCells - 1 - row;
      const int to = row * kHalf + column;
      for (int i = 0; i < kCellRow; i += kLanes) {
        const Number at = load(cells.y[row * kCells + column] + i);
        const Number right = load(cells.y[row * kCells + mirrored] + i);
        const Number down = load(cells.y[below * kCells + column] + i);
        const Number across = load(cells.y[below * kCells + mirrored] + i);
        const Number even = at + right, odd = at - right;
        const Number even_down = down + across, odd_down = down - across;
        store(even + even_down, folded[0][0][to] + i);
        store(odd + odd_down, folded[0][1][to] + i);
        store(even - even_down, folded[1][0][to] + i);
        store(odd - odd_down, folded[1][1][to] + i);
      }
    }
}

// Their covariance with each other: folded over the rows, then over the columns.
inline void
foldCovariance(const CellSums& cells, FoldedCovariance& folded)
{
  for (int row = 0; row < kHalf; ++row)
    for (int other = 0; other < kHalf; ++other) {
      const double* near = cells.covariance[row > other ? row - other : other - row];
      const double* far = cells.covariance[kCells - 1 - row - other];
      for (int odd = 0; odd < 2; ++odd) {
        double C[kCells];
        for (int across = 0; across < kCells; ++across)
          C[across] = odd ? near[across] - far[across] : near[across] + far[across];
        for (int a = 0; a < kHalf; ++a)
          for (int b = 0; b < kHalf; ++b) {
            const double beside = C[a > b ? a - b : b - a],
                         mirror = C[kCells - 1 - a - b];
            const int from = row * kHalf + a, to = other * kHalf + b;
            folded[odd][0][from][to] = beside + mirror;
            folded[odd][1][from][to] = beside - mirror;
          }
      }
    }
}

// Cells, or rows of the sum, that are worked on together: what one adds up waits for
// itself.
constexpr int kAtOnce = 4;

// C y of the quarter.
HOLDFAST_INLINE void
weighCells(const double y[kQuarter][kCellRow],
           const double C[kQuarter][kQuarter],
           double weighted[kQuarter][kCellRow])
{
  for (int a = 0; a < kQuarter; a += kAtOnce) {
    Number sum[kAtOnce][kRowNumbers];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < kAtOnce; ++k)
      HOLDFAST_UNROLLED_FOR (int i = 0; i < kRowNumbers; ++i)
        sum[k][i] = Number(0.0);
    for (int b = 0; b < kQuarter; ++b)
      HOLDFAST_UNROLLED_FOR (int i = 0; i < kRowNumbers; ++i) {
        const Number of_b = load(y[b] + i * kLanes);
        HOLDFAST_UNROLLED_FOR (int k = 0; k < kAtOnce; ++k)
          sum[k][i] = sum[k][i] + of_b * C[a + k][b];
      }
    HOLDFAST_UNROLLED_FOR (int k = 0; k < kAtOnce; ++k)
      HOLDFAST_UNROLLED_FOR (int i = 0; i < kRowNumbers; ++i)
        store(sum[k][i], weighted[a + k] + i * kLanes);
  }
}

// Rows `first` and following of a quarter (foldCells() counts y twice in each
// direction) of sum_a y_a (C y)_a^T, from the diagonal on.
template <int first>
HOLDFAST_INLINE void
sumRows(const FoldedCells& y, const FoldedCells& weighted, double* out)
{
  constexpr int kFrom = first / kLanes;
  Number sum[kAtOnce][kRowNumbers];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < kAtOnce; ++k)
    HOLDFAST_UNROLLED_FOR (int i = kFrom; i < kRowNumbers; ++i)
      sum[k][i] = Number(0.0);
  const double* const of_y = y[0][0][0] + first;
  const double* const of_weighted = weighted[0][0][0];
  for (int cell = 0; cell < 4 * kQuarter * kCellRow; cell += kCellRow)
    HOLDFAST_UNROLLED_FOR (int i = kFrom; i < kRowNumbers; ++i) {
      const Number other = load(of_weighted + cell + i * kLanes);
      HOLDFAST_UNROLLED_FOR (int k = 0; k < kAtOnce; ++k)
        sum[k][i] = sum[k][i] + other * of_y[cell + k];
    }
  HOLDFAST_UNROLLED_FOR (int k = 0; k < kAtOnce; ++k)
    HOLDFAST_UNROLLED_FOR (int i = kFrom; i < kRowNumbers; ++i)
      store(sum[k][i] * 0.25, out + (first + k) * kCellRow + i * kLanes);
}

inline void
sumOverCells(const CellSums& cells, double* out)
{
  alignas(64) FoldedCells y, weighted;
  FoldedCovariance C;
  foldCells(cells, y);
  foldCovariance(cells, C);
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 2; ++column)
      weighCells(y[row][column], C[row][column], weighted[row][column]);
  static_assert(kCellRow == 4 * kAtOnce, "as many rows");
  sumRows<0>(y, weighted, out);
  sumRows<kAtOnce>(y, weighted, out);
  sumRows<2 * kAtOnce>(y, weighted, out);
  sumRows<3 * kAtOnce>(y, weighted, out);
  for (int row = 0; row < kCellRow; ++row)
    for (int column = 0; column < row; ++column)
      out[row * kCellRow + column] = out[column * kCellRow + row];
}
