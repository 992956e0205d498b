// What the covariance pass sums once the X_i are known, for any number type. Included
// after kernel_evaluation.inl and kernel_cells.inl.

// A tile of points, local frame.
template <int p>
struct Tile {
  int size;
  Number S[kTile][6], qt[kTile][3], X[kTile][p][3];
};

// The sums of kernel.h.
template <int p, int shape>
struct CrossTotals {
  template <typename T>
  struct Of {
    T H[shape * (shape + 1) / 2];
    T X[p][3], XX[p * (p + 1) / 2], XS[p][3], XSq[p][6];
    T S[6], qS[3][6], qqS[6][6];
  };
};

template <int p, int shape>
struct CrossSums : CrossTotals<p, shape>::template Of<Number> {};

template <int p, int shape>
void
reduce(const CrossSums<p, shape>& sums, CovarianceSums& out)
{
  typename CrossTotals<p, shape>::template Of<double> total;
  reduce<CrossTotals<p, shape>::template Of>(sums, total);
  const auto copyAll = [](const auto& from, auto* to) {
    const auto* first = reinterpret_cast<const double*>(&from);
    std::copy(first,
              first + sizeof(from) / sizeof(double),
              reinterpret_cast<double*>(to));
  };
  copyAll(total.H, out.H);
  copyAll(total.X, out.X);
  copyAll(total.XX, out.XX);
  copyAll(total.XS, out.XS);
  copyAll(total.XSq, out.XSq);
  copyAll(total.S, out.S);
  copyAll(total.qS, out.qS);
  copyAll(total.qqS, out.qqS);
  for (int a = 0; a < p; ++a)
    for (const int diagonal : {0, 3, 5})
      out.XSq[a][diagonal] *= 2.0; // summed once
}

// Sums over a tile of what X_a is multiplied with.
template <int a, int p, int shape>
HOLDFAST_INLINE void
addCrossRow(const Tile<p>& tile, CrossSums<p, shape>& sums)
{
  constexpr int first = packed(a, a, p);
  Number X[3], XS[3], XSq[6], XX[p - a];
  copy(sums.X[a], X), copy(sums.XS[a], XS), copy(sums.XSq[a], XSq);
  HOLDFAST_UNROLLED_FOR (int b = a; b < p; ++b)
    XX[b - a] = sums.XX[first + b - a];
  for (int i = 0; i < tile.size; ++i) {
    const Number* qt = tile.qt[i];
    Number noisy[3];
    multiply(tile.S[i], tile.X[i][a], noisy);
    HOLDFAST_UNROLLED_FOR (int k = 0, pair = 0; k < 3; ++k) {
      X[k] = X[k] + tile.X[i][a][k];
      XS[k] = XS[k] + noisy[k];
      HOLDFAST_UNROLLED_FOR (int j = k; j < 3; ++j, ++pair) {
        XSq[pair] = XSq[pair] + noisy[k] * qt[j];
        if (j != k)
          XSq[pair] = XSq[pair] + noisy[j] * qt[k];
      }
    }
    HOLDFAST_UNROLLED_FOR (int b = a; b < p; ++b)
      XX[b - a] = XX[b - a] + dot(noisy, tile.X[i][b]);
  }
  copy(X, sums.X[a]), copy(XS, sums.XS[a]), copy(XSq, sums.XSq[a]);
  HOLDFAST_UNROLLED_FOR (int b = a; b < p; ++b)
    sums.XX[first + b - a] = XX[b - a];
}

// Sums of entry e of Sigma, which do not depend on the surface: how the noise of the
// points moves their moments.
template <int p, int shape>
HOLDFAST_INLINE void
addMoments(int e, const Tile<p>& tile, CrossSums<p, shape>& sums)
{
  Number S = sums.S[e], qS[3], qqS[6];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    qS[k] = sums.qS[k][e];
  HOLDFAST_UNROLLED_FOR (int pair = 0; pair < 6; ++pair)
    qqS[pair] = sums.qqS[pair][e];
  for (int i = 0; i < tile.size; ++i) {
    S = S + tile.S[i][e];
    HOLDFAST_UNROLLED_FOR (int a = 0, pair = 0; a < 3; ++a) {
      const Number product = tile.qt[i][a] * tile.S[i][e];
      qS[a] = qS[a] + product;
      HOLDFAST_UNROLLED_FOR (int b = a; b < 3; ++b, ++pair)
        qqS[pair] = qqS[pair] + product * tile.qt[i][b];
    }
  }
  sums.S[e] = S;
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    sums.qS[k][e] = qS[k];
  HOLDFAST_UNROLLED_FOR (int pair = 0; pair < 6; ++pair)
    sums.qqS[pair][e] = qqS[pair];
}

// Responses to what the points share, and the noise with what is extra. After the
// Hessian, which is that of the weights.
template <int p>
HOLDFAST_INLINE void
sharePattern(const Points& points,
             const State& state,
             int first,
             Tile<p>& tile,
             CellTotals& cells)
{
  const PatternPoints& pattern = *points.pattern;
  for (int i = 0; i < tile.size; ++i) {
    const int at = first + i * kLanes;
    Number r[3], outside[3], response[p];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      outside[k] = load(pattern.direction[k] + at);
    rotateIntoFrame(state.R, outside, r);
    HOLDFAST_UNROLLED_FOR (int a = 0; a < p; ++a)
      response[a] = dot(tile.X[i][a], r);
    cells.add<p>(at, response, tile.qt[i], r);
    const Number extra = load(pattern.extra + at);
    Number* S = tile.S[i];
    HOLDFAST_UNROLLED_FOR (int b = 0, pair = 0; b < 3; ++b)
      HOLDFAST_UNROLLED_FOR (int c = b; c < 3; ++c, ++pair)
        S[pair] = S[pair] + extra * r[b] * r[c];
  }
}

template <int p, int shape, int... a>
HOLDFAST_INLINE void
addCrossTerms(const Points& points,
              const State& state,
              int first,
              Tile<p>& tile,
              CellTotals& cells,
              CrossSums<p, shape>& sums,
              std::integer_sequence<int, a...>)
{
  if (points.pattern != nullptr)
    sharePattern(points, state, first, tile, cells);
  (addCrossRow<a>(tile, sums), ...);
  for (int e = 0; e < 6; ++e)
    addMoments(e, tile, sums);
}
