// The covariance pass of the ray residual, through the foot of every point on its ray;
// for any number type. Included after kernel_cross.inl and
//
//   FootSearch<Surface>   find(points, i, Foot&) finds the feet of kLanes points and
//   adds
//                         to cost and L, which reduce(CovarianceSums&) writes;
//                         allMeet(): no ray was within a quarter of missing so far (and
//                         none too grazing for the digits of the number)
//
// With s the smaller root of f - s V + s^2 w = 0, the foot p = q - s t lies on the
// surface and E = s^2 V / 2. Its derivatives close up where the expansion by f, V and w
// of kernel_point.inl has six second partials:
//
//   u = t - s r   D = V - 2 s w   psi = s V / D   kappa = s psi   omega = V^2 / D
//   s_q = (G (p - s u) - 2 e_z) / D
//   b_a = Sigma B_a   alpha_a = B_a.t   eta_a = t^T G_a t + 2 B_a.r
//   s_a = (f_a(p) - s B_a.u) / D
//   e_a = 2 (s - psi) alpha_a + psi s eta_a      zeta_a = omega s_a + e_a
//   n_a = Sigma ((s^2 - 2 kappa) B_a + kappa s (G_a t + G b_a))
//   m1 = (s^2 - kappa) t - kappa u               m2 = 2 (s t - psi u)
//   X_a = s_q zeta_a + psi B_a + G_a m1 + G (n_a + s_a m2)
//   H_ab = s_a zeta_b + s_b e_a + n_a.B_b + kappa s b_a.(G_b t) + L[f_ab]
//   L[p] = sum( psi p + grad p.m1 + kappa s t^T (hess p) t / 2 )

// Along a parameter, of every point of a tile.
template <int p>
struct FootSlopes {
  Number s[kTile][p], e[kTile][p];
};

// Adds row a of H, and leaves X_a in the tile.
template <int a, typename Surface, int p, int shape>
HOLDFAST_INLINE void
addFootRow(const Surface& surface,
           const Foot* feet,
           FootSlopes<p>& slopes,
           Tile<p>& tile,
           CrossSums<p, shape>& sums)
{
  constexpr int columns = a < shape ? a + 1 : 0;
  Number H[columns + 1];
  HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b)
    H[b] = sums.H[packed(b, a, shape)];
  for (int i = 0; i < tile.size; ++i) {
    const Foot& foot = feet[i];
    const SurfaceDerivatives<Surface> d(surface, foot.q, foot.t);
    const Number* B = d.B[a];
    Number at_foot[kPolynomials], f_a[p], b_a[3], G_b[3], N[3], n[3], moved[3], G_v[3];
    monomials(foot.p, at_foot);
    surface.combine(at_foot, f_a);
    multiply(foot.S, B, b_a);
    surface.applyG(b_a, G_b);
    const Number s_a = (f_a[a] - foot.s * dot(B, foot.u)) * foot.inverse_D;
    const Number e_a = (foot.s - foot.psi) * dot(B, foot.t) * 2.0 +
                       foot.kappa * (d.tGt[a] + dot(B, foot.r)) * 2.0;
    const Number zeta = foot.omega * s_a + e_a;
    const Number of_B = foot.s * foot.s - foot.kappa * 2.0;
    const Number kappa_s = foot.kappa * foot.s;
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      N[k] = of_B * B[k] + kappa_s * (d.Gt[a][k] + G_b[k]);
    multiply(foot.S, N, n);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      moved[k] = n[k] + s_a * foot.m2[k];
    surface.applyG(moved, G_v);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
      Number row[kPolynomials], G_a_m1[p];
      hessianRow(k, foot.m1, row);
      surface.combine(row, G_a_m1);
      tile.X[i][a][k] = foot.s_q[k] * zeta + foot.psi * B[k] + G_a_m1[a] + G_v[k];
    }
    slopes.s[i][a] = s_a;
    slopes.e[i][a] = e_a;
    HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b)
      H[b] = H[b] + slopes.s[i][b] * zeta + s_a * slopes.e[i][b] + dot(n, d.B[b]) +
             kappa_s * dot(b_a, d.Gt[b]);
  }
  HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b)
    sums.H[packed(b, a, shape)] = H[b];
}

template <typename Surface, int p, int shape, int... a>
HOLDFAST_INLINE void
addFootRows(const Surface& surface,
            const Foot* feet,
            Tile<p>& tile,
            CrossSums<p, shape>& sums,
            std::integer_sequence<int, a...>)
{
  FootSlopes<p> slopes;
  (addFootRow<a>(surface, feet, slopes, tile, sums), ...);
}

// \return false where some ray is within a quarter of missing the surface: these
// derivatives do not hold there.
template <typename Surface>
bool
footSums(const Points& points, const State& state, CovarianceSums& out)
{
  constexpr int p = parameterCount(Surface::kModel);
  constexpr int shape = shapeParameterCount(Surface::kModel);
  constexpr std::make_integer_sequence<int, p> rows;
  const Surface surface{state};
  CrossSums<p, shape> sums;
  CellTotals cells(points);
  FootSearch<Surface> search(surface);
  setZero(sums);
  Tile<p> tile;
  Foot feet[kTile];
  for (int first = 0; first < points.padded_size; first += kTile * kLanes) {
    tile.size = tileSize(points, first);
    for (int i = 0; i < tile.size; ++i) {
      search.find(points, first + i * kLanes, feet[i]);
      copy(feet[i].S, tile.S[i]);
      HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
        tile.qt[i][k] = feet[i].q[k] - state.centroid[k];
    }
    if (!search.allMeet())
      return false;
    addFootRows(surface, feet, tile, sums, rows);
    addCrossTerms(points, state, first, tile, cells, sums, rows);
  }
  cells.finish();
  reduce(sums, out);
  search.reduce(out);
  surface.combine(out.L, out.gradient);
  return true;
}
