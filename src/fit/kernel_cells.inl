// Points that share errors, by the cells of a grid over them (fit/pattern.h), for any
// number type. Included before kernel_cross.inl and after
//
//   findCells(pattern, i, double rows[kLanes])
//                             which rows of CellSums::y those of kLanes points are, as
//                             offsets

// Sums of y_i, gathered in the precision of the number.
class CellTotals {
public:
  HOLDFAST_INLINE explicit CellTotals(const Points& points)
  : pattern_(points.pattern != nullptr && points.pattern->cells != nullptr ?
                 points.pattern :
                 nullptr)
  {
    if (pattern_ != nullptr)
      std::fill_n(y_[0], kCells * kCells * kCellRow, Scalar(0.0));
  }

  // Of kLanes points. Not inlined: the sums of the pass would lose registers to it.
  template <int p>
  HOLDFAST_NOINLINE void add(int i,
                             const Number response[p],
                             const Number qt[3],
                             const Number r[3])
  {
    if (pattern_ == nullptr)
      return;
    alignas(64) Scalar y[kCellRow * kLanes];
    alignas(64) double rows[kLanes];
    writeTerms<p>(response, qt, r, y);
    findCells(*pattern_, i, rows);
    // Unrolled, rows would be put together in registers, which takes longer.
    HOLDFAST_ROLLED_FOR (int lane = 0; lane < kLanes; ++lane)
      addRow(y, lane, y_[0] + static_cast<int>(rows[lane]));
  }

  HOLDFAST_INLINE void finish() const
  {
    if (pattern_ == nullptr)
      return;
    for (int cell = 0; cell < kCells * kCells; ++cell)
      for (int k = 0; k < kCellRow; k += kLanes)
        store(load(y_[cell] + k), pattern_->cells->y[cell] + k);
  }

private:
  // Four by four.
  template <int p>
  HOLDFAST_INLINE void writeTerms(const Number response[p],
                                  const Number qt[3],
                                  const Number direction[3],
                                  Scalar* y) const
  {
    Number term[kCellRow];
    HOLDFAST_UNROLLED_FOR (int a = 0; a < kMaxTheta; ++a)
      term[a] = a < p ? response[a] : Number(0.0);
    Number* r = term + kMaxTheta;
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      r[k] = direction[k] * pattern_->per_count;
    Number* moment = r + 3;
    HOLDFAST_UNROLLED_FOR (int b = 0, entry = 0; b < 3; ++b)
      HOLDFAST_UNROLLED_FOR (int c = b; c < 3; ++c, ++entry)
        moment[entry] = qt[b] * r[c] + qt[c] * r[b];
    term[kCellRow - 1] = Number(0.0);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < kCellRow; k += 4)
      storeByLane(term + k, y + k * kLanes);
  }

  const PatternPoints* pattern_;
  alignas(64) Scalar y_[kCells * kCells][kCellRow];
};

// ---- Sums over the cells of a grid --------------------------------------------------
//
// C does not change when both cells are mirrored, so that what is even about a middle
// line of the grid and what is odd have no covariance: four sums over a quarter of the
// cells, each with itself, in place of one over all pairs.

constexpr int kHalf = kCells / 2;
constexpr int kQuarter = kHalf * kHalf;
constexpr int kRowNumbers = kCellRow / kLanes;

// Of the quarter: even (0) or odd (1) about the middle row, then about the column.
using FoldedCells = Scalar[2][2][kQuarter][kCellRow];
using FoldedCovariance = Scalar[2][2][kQuarter][kQuarter];

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
            folded[odd][0][from][to] = static_cast<Scalar>(beside + mirror);
            folded[odd][1][from][to] = static_cast<Scalar>(beside - mirror);
          }
      }
    }
}

// Cells, or rows of the sum, that are worked on together: what one adds up waits for
// itself.
constexpr int kAtOnce = kRowNumbers == 1 ? 8 : 4;

// C y of the quarter.
HOLDFAST_INLINE void
weighCells(const Scalar y[kQuarter][kCellRow],
           const Scalar C[kQuarter][kQuarter],
           Scalar weighted[kQuarter][kCellRow])
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
  const Scalar* const of_y = y[0][0][0] + first;
  const Scalar* const of_weighted = weighted[0][0][0];
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

template <int... group>
HOLDFAST_INLINE void
sumGroups(const FoldedCells& y,
          const FoldedCells& weighted,
          double* out,
          std::integer_sequence<int, group...>)
{
  (sumRows<group * kAtOnce>(y, weighted, out), ...);
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
  sumGroups(y, weighted, out, std::make_integer_sequence<int, kCellRow / kAtOnce>());
  for (int row = 0; row < kCellRow; ++row)
    for (int column = 0; column < row; ++column)
      out[row * kCellRow + column] = out[column * kCellRow + row];
}
