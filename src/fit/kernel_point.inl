// The per-point mathematics of the fit, for any number type. No include guard: this
// file is included once for every instruction set, inside that set's namespace, after
// the definition of
//
//   Number                    arithmetic type with + - * / among itself and with double
//   kLanes                    points per Number
//   load(const double*)       kLanes consecutive doubles, aligned as those of a batch
//   loadAnywhere(const double*)   the same, however they are aligned
//   store(Number, double*)    the reverse
//   storeByLane(const Number x[4], double*)
//                             the same of four, lane by lane
//   Scalar                    one of those in a Number, which load() and store() also
//                             take
//   addRow(const Scalar* y, int lane, Scalar* sum)
//                             adds kCellRow numbers of a lane, which storeByLane() has
//                             stored four by four
//   roundedDown(Number)
//   sumOfLanes(Number)        their sum
//   sumsOfLanes(const Number*, double*)
//                             those of kLanes Numbers
//   squareRoot(Number)
//   selectLess(a, b, x, y)    a < b ? x : y, lane by lane
//   allLess(a, b)             a < b in every lane
//   HOLDFAST_INLINE           before functions of the hot loop
//   HOLDFAST_NOINLINE         before those that are to be called
//   HOLDFAST_UNROLLED_FOR     `for` of constant length, whose arrays then live in
//                             registers
//   HOLDFAST_ROLLED_FOR       the reverse
//
// The notation is that of fit/kernel.h.

#include "kernel_surface.inl"

// Coordinates and f of points, where digits cancel.
template <typename Surface>
HOLDFAST_INLINE void
placeInFrame(const Surface& surface,
             const Points& points,
             int i,
             Number q[3],
             Number& f)
{
  Number offset[3], g[3];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    offset[k] = load(points.channel[k] + i) - surface.s.c[k];
  rotateIntoFrame(surface.s.R, offset, q);
  surface.applyG(q, g);
  f = dot(q, g) * 0.5 - q[2] * 2.0;
}

#include "kernel_evaluation.inl"

HOLDFAST_INLINE Number
smaller(Number a, Number b)
{
  return selectLess(a, b, a, b);
}

HOLDFAST_INLINE Number
larger(Number a, Number b)
{
  return selectLess(a, b, b, a);
}

// The cells of points; pixels beyond all reason are in some cell, too.
HOLDFAST_INLINE void
findCells(const PatternPoints& pattern, int i, double* rows)
{
  const CellGrid& grid = pattern.grid;
  const Number first(0.0), last(kCells - 1.0);
  Number at[2];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 2; ++k) {
    const Number exact =
        (load(pattern.pixel[k] + i) - grid.corner[k]) * grid.inverse_side;
    at[k] = roundedDown(larger(first, smaller(exact, last)));
  }
  store((at[1] * kCells + at[0]) * kCellRow, rows);
}

#include "kernel_cells.inl"

#include "kernel_cross.inl"

// Cost, L and their like, which cancel: in double whatever the rest is in.
struct LTotals {
  template <typename T>
  struct Of {
    T cost, L[kPolynomials];
  };
};

HOLDFAST_INLINE void
addL(const Number change[kPolynomials], Number cost, LTotals::Of<Number>& sums)
{
  sums.cost = sums.cost + cost;
  HOLDFAST_UNROLLED_FOR (int k = 0; k < kPolynomials; ++k)
    sums.L[k] = sums.L[k] + change[k];
}

inline void
reduceL(const LTotals::Of<Number>& sums, CovarianceSums& out)
{
  LTotals::Of<double> total;
  reduce<LTotals::Of>(sums, total);
  out.cost = total.cost;
  std::copy(std::begin(total.L), std::end(total.L), out.L);
}

#include "kernel_foot_point.inl"

// Finds feet, with their share of cost and L.
template <typename Surface>
class FootSearch {
public:
  HOLDFAST_INLINE explicit FootSearch(const Surface& surface)
  : surface_(surface), smallest_(1.0), slack_(1.0)
  {
    setZero(sums_);
  }

  HOLDFAST_INLINE void find(const Points& points, int i, Foot& foot)
  {
    Local<LocalNoise> local;
    locate(points, i, local, foot);
    copy(local.noise.S, foot.S);
  }

  // All but foot.S. \return V / D.
  template <typename Noise>
  HOLDFAST_INLINE Number
  locate(const Points& points, int i, Local<Noise>& local, Foot& foot)
  {
    enterFrame<RayResidual>(surface_, points, i, local);
    const Number inverse = local.weight / local.V, h = local.f * inverse;
    const Number x = 1.0 - h * local.w * inverse * 4.0;
    smallest_ = selectLess(x, smallest_, x, smallest_);
    const Number* S = local.noise.S;
    const Number slack =
        local.V - dot(local.g, local.g) * (S[0] + S[3] + S[5]) * kGrazing;
    slack_ = selectLess(slack, slack_, slack, slack_);
    const Number quarter(0.25);
    const Number root = squareRoot(selectLess(x, quarter, quarter, x));
    const Number V_over_D = 1.0 / root;
    copy(local.q, foot.q), copy(local.t, foot.t), copy(local.r, foot.r);
    foot.s = h * 2.0 / (1.0 + root);
    foot.inverse_D = inverse * V_over_D;
    foot.omega = local.V * V_over_D;
    foot.complete(surface_, V_over_D);
    Number change[kPolynomials];
    changeAlong(foot.q, foot.t, foot.psi, foot.m1, foot.kappa * foot.s, change);
    addL(change, foot.s * foot.s * local.V * 0.5, sums_);
    return V_over_D;
  }

  HOLDFAST_INLINE bool allMeet() const
  {
    return allLess(Number(0.25), smallest_);
  }

  // Whether the surface lies across the noise of every point so far: else V is a small
  // share of what Sigma holds, and digits of Sigma are lost in it.
  HOLDFAST_INLINE bool allAcross() const
  {
    return allLess(Number(0.0), slack_);
  }

  void reduce(CovarianceSums& out) const
  {
    reduceL(sums_, out);
  }

private:
  const Surface& surface_;
  static constexpr double kGrazing = 1e-3; // a surface seen at 88 degrees

  LTotals::Of<Number> sums_;
  Number smallest_; // 1 - tau
  Number slack_; // V less its least share
};

#include "kernel_foot.inl"

#include "kernel_choice.inl"

// A point with the derivatives of its E. E depends on theta and q through f, g and G:
// dE = E_f df + mu.dg + E_w t^T dG t / 2 with mu = 2 E_V t + E_w r.
struct Expansion : Local<LocalNoise> {
  Number E, E_f, twice_E_V, E_w, mu[3];
  SecondPartials second;

  template <typename ResidualPolicy>
  HOLDFAST_INLINE void expand()
  {
    const ResidualPolicy residual(f, V, w, weight);
    const ScaledResidual e = residual.first();
    const Number scale = residual.inverse * e.e;
    E = scale * e.e * 0.5;
    E_f = scale * e.f;
    twice_E_V = scale * e.V * 2.0;
    E_w = scale * e.w;
    slopeInG(*this, scale * e.V, E_w, mu);
    second = residual.second();
  }
};

// Derivatives along theta_a of E_f, mu, E_w and t, and X_a = d^2E / dtheta_a dq:
//   t_a = Sigma B_a,
//   mu_a = Sigma (2 E_Va g + E_wa G t + 2 E_V B_a + E_w (G t_a + G_a t)),
// and from E_q = E_f g + G mu,  X_a = E_fa g + E_f B_a + G mu_a + G_a mu.
struct Along {
  Number E_f, E_w, mu[3], t[3], X[3];
};

template <int a, typename ResidualPolicy, typename Surface>
HOLDFAST_INLINE void
differentiateAlong(const Surface& surface,
                   const Expansion& p,
                   const SurfaceDerivatives<Surface>& d,
                   Along& along)
{
  const SecondPartials& E = p.second;
  const Number* B = d.B[a];
  const Number f_a = d.f[a], V_a = dot(B, p.t) * 2.0;
  Number E_Va = E.fV * f_a + E.VV * V_a, change[3], G_mu_a[3];
  along.E_f = E.ff * f_a + E.fV * V_a;
  if (ResidualPolicy::kUsesCurvature) {
    const Number w_a = dot(B, p.r) + d.tGt[a];
    along.E_f = along.E_f + E.fw * w_a;
    along.E_w = E.fw * f_a + E.Vw * V_a + E.ww * w_a;
    E_Va = E_Va + E.Vw * w_a;
  }
  const Number twice_E_Va = E_Va * 2.0;
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
    change[i] = p.g[i] * twice_E_Va + B[i] * p.twice_E_V;
  if (ResidualPolicy::kUsesCurvature) {
    Number G_t_a[3];
    multiply(p.noise.S, B, along.t);
    surface.applyG(along.t, G_t_a);
    HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
      change[i] = change[i] + p.Gt[i] * along.E_w + (G_t_a[i] + d.Gt[a][i]) * p.E_w;
  }
  multiply(p.noise.S, change, along.mu);
  surface.applyG(along.mu, G_mu_a);
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
    Number row[kPolynomials], G_a_mu[SurfaceDerivatives<Surface>::kCount];
    hessianRow(k, p.mu, row);
    surface.combine(row, G_a_mu);
    along.X[k] = p.g[k] * along.E_f + B[k] * p.E_f + G_mu_a[k] + G_a_mu[a];
  }
}

// Adds row a of H, and leaves X_a in the tile.
template <int a, typename ResidualPolicy, typename Surface, int p, int shape>
HOLDFAST_INLINE void
addHessianRow(const Surface& surface,
              const Expansion* points,
              Tile<p>& tile,
              CrossSums<p, shape>& sums)
{
  constexpr int columns = a < shape ? a + 1 : 0;
  Number H[columns + 1];
  HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b)
    H[b] = sums.H[packed(b, a, shape)];
  for (int i = 0; i < tile.size; ++i) {
    const Expansion& point = points[i];
    const SurfaceDerivatives<Surface> d(surface, point.q, point.t);
    Along along;
    differentiateAlong<a, ResidualPolicy>(surface, point, d, along);
    copy(along.X, tile.X[i][a]);
    HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b) {
      H[b] = H[b] + along.E_f * d.f[b] + dot(d.B[b], along.mu);
      if (ResidualPolicy::kUsesCurvature)
        H[b] = H[b] + along.E_w * d.tGt[b] + dot(d.Gt[b], along.t) * point.E_w;
    }
  }
  HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b)
    sums.H[packed(b, a, shape)] = H[b];
}

template <typename ResidualPolicy, typename Surface, int p, int shape, int... a>
HOLDFAST_INLINE void
addHessian(const Surface& surface,
           const Expansion* points,
           Tile<p>& tile,
           CrossSums<p, shape>& sums,
           std::integer_sequence<int, a...>)
{
  (addHessianRow<a, ResidualPolicy>(surface, points, tile, sums), ...);
}

// By the chain rule through f, V and w: any residual, wherever the ray goes.
template <typename Surface, typename ResidualPolicy>
void
covarianceSums(const Points& points, const State& state, CovarianceSums& out)
{
  constexpr int p = parameterCount(Surface::kModel);
  constexpr int shape = shapeParameterCount(Surface::kModel);
  constexpr std::make_integer_sequence<int, p> rows;
  const Surface surface{state};
  CrossSums<p, shape> sums;
  CellTotals cells(points);
  LTotals::Of<Number> of_L;
  setZero(sums);
  setZero(of_L);
  Tile<p> tile;
  Expansion expanded[kTile];
  for (int first = 0; first < points.padded_size; first += kTile * kLanes) {
    tile.size = tileSize(points, first);
    for (int i = 0; i < tile.size; ++i)
      enterFrame<ResidualPolicy>(surface, points, first + i * kLanes, expanded[i]);
    for (int i = 0; i < tile.size; ++i) {
      Expansion& point = expanded[i];
      point.expand<ResidualPolicy>();
      Number change[kPolynomials];
      changeAlong(point.q, point.t, point.E_f, point.mu, point.E_w, change);
      addL(change, point.E, of_L);
      copy(point.noise.S, tile.S[i]);
      HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
        tile.qt[i][k] = point.q[k] - state.centroid[k];
    }
    addHessian<ResidualPolicy>(surface, expanded, tile, sums, rows);
    addCrossTerms(points, state, first, tile, cells, sums, rows);
  }
  cells.finish();
  reduce(sums, out);
  reduceL(of_L, out);
  surface.combine(out.L, out.gradient);
}

template <typename ResidualPolicy, typename Surface, int... a>
void
crossTermsOf(const Surface& surface,
             const Expansion& point,
             double* out,
             std::integer_sequence<int, a...>)
{
  const SurfaceDerivatives<Surface> d(surface, point.q, point.t);
  Along along[sizeof...(a)];
  (differentiateAlong<a, ResidualPolicy>(surface, point, d, along[a]), ...);
  for (const Along& parameter : along)
    for (const Number& X : parameter.X)
      *out++ = sumOfLanes(X);
}

// X_i of every point, padding included: p x 3 values per step.
template <typename Surface, typename ResidualPolicy>
void
crossTermsOfPoints(const Points& points, const State& state, double* out)
{
  constexpr int p = parameterCount(Surface::kModel);
  const Surface surface{state};
  for (int i = 0; i < points.padded_size; i += kLanes, out += 3 * p) {
    Expansion point;
    enterFrame<ResidualPolicy>(surface, points, i, point);
    point.expand<ResidualPolicy>();
    crossTermsOf<ResidualPolicy>(surface,
                                 point,
                                 out,
                                 std::make_integer_sequence<int, p>());
  }
}

inline void
accumulateScatter(const Points& points, ScatterSums& out)
{
  Number q[3], qq[6], sigma[6];
  for (Number& sum : q)
    sum = Number(0.0);
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e)
    qq[e] = sigma[e] = Number(0.0);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    const Number weight = load(points.channel[9] + i);
    Number v[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
      v[k] = load(points.channel[k] + i) * weight;
      q[k] = q[k] + v[k];
    }
    HOLDFAST_UNROLLED_FOR (int a = 0, pair = 0; a < 3; ++a)
      HOLDFAST_UNROLLED_FOR (int b = a; b < 3; ++b, ++pair)
        qq[pair] = qq[pair] + v[a] * v[b];
    HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e)
      sigma[e] = sigma[e] + load(points.channel[3 + e] + i);
  }
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    out.q[k] = sumOfLanes(q[k]);
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e) {
    out.qq[e] = sumOfLanes(qq[e]);
    out.sigma[e] = sumOfLanes(sigma[e]);
  }
}

inline void
accumulateQuadric(const Points& points,
                  const double R[9],
                  const double c[3],
                  QuadricSums& out)
{
  Number monomial[15], height[6];
  for (Number& sum : monomial)
    sum = Number(0.0);
  for (Number& sum : height)
    sum = Number(0.0);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Number offset[3], q[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      offset[k] = load(points.channel[k] + i) - c[k];
    const Number weight = load(points.channel[9] + i);
    rotateIntoFrame(R, offset, q);
    Number term[15];
    term[0] = weight;
    HOLDFAST_UNROLLED_FOR (int degree = 1, at = 1; degree <= 4; ++degree) {
      const int previous = at - degree;
      HOLDFAST_UNROLLED_FOR (int k = 0; k < degree; ++k)
        term[at + k] = term[previous + k] * q[0];
      term[at + degree] = term[at - 1] * q[1];
      at += degree + 1;
    }
    HOLDFAST_UNROLLED_FOR (int e = 0; e < 15; ++e)
      monomial[e] = monomial[e] + term[e];
    HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e)
      height[e] = height[e] + term[e] * q[2];
  }
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 15; ++e)
    out.monomial[e] = sumOfLanes(monomial[e]);
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e)
    out.z[e] = sumOfLanes(height[e]);
}

inline void
moveOntoQuadric(const Points& points,
                const double R[9],
                const double c[3],
                const double h[6],
                const double viewpoint[3],
                double* const out[3])
{
  Number origin[3], camera[3];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    origin[k] = Number(viewpoint[k] - c[k]);
  rotateIntoFrame(R, origin, camera);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Number offset[3], q[3], ray[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      offset[k] = load(points.channel[k] + i) - c[k];
    rotateIntoFrame(R, offset, q);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      ray[k] = q[k] - camera[k];
    Number move(0.0); // t - 1
    HOLDFAST_UNROLLED_FOR (int step = 0; step < 2; ++step) {
      const Number x = q[0] + move * ray[0], y = q[1] + move * ray[1];
      const Number hx = x * h[3] + y * h[4], hy = x * h[4] + y * h[5];
      const Number height = x * (hx * 0.5 + h[1]) + y * (hy * 0.5 + h[2]) + h[0];
      const Number slope = ray[2] - ray[0] * (hx + h[1]) - ray[1] * (hy + h[2]);
      move = move - (q[2] + move * ray[2] - height) / slope;
    }
    const Number limit(0.1);
    move = selectLess(move, limit, move, Number(0.0));
    move = selectLess(0.0 - limit, move, move, Number(0.0));
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      store(load(points.channel[k] + i) * (move + 1.0) - move * viewpoint[k],
            out[k] + i);
  }
}

// Twice every point's share of the cost.
template <typename Surface, typename ResidualPolicy>
void
residualsOfPoints(const Points& points, const State& state, double* out)
{
  const Surface surface{state};
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Local<BatchNoise> local;
    enterFrame<ResidualPolicy>(surface, points, i, local);
    const ResidualPolicy residual(local.f, local.V, local.w, local.weight);
    const Number e = residual.first().e;
    store(e * e * residual.inverse, out + i);
  }
}

HOLDFAST_INLINE Number
reachOf(const BoundaryForm& boundary, Number x, Number y)
{
  if (boundary.is_ellipse) {
    const Number u = x * boundary.ax[0], v = y * boundary.ay[0];
    return u * u + v * v;
  }
  Number side[4];
  HOLDFAST_UNROLLED_FOR (int s = 0; s < 4; ++s)
    side[s] = x * boundary.ax[s] + y * boundary.ay[s];
  return larger(larger(side[0], side[1]), larger(side[2], side[3]));
}

// Square of the smaller root t of f(q - t h) = f - 2 t h^2 + t^2 h^T K h, h half the
// gradient, times h^2; of the extremum where there is no root.
HOLDFAST_INLINE Number
squaredDistance(const double k[3], const Number q[3])
{
  Number h[3], Kh[3];
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
    h[i] = q[i] * k[i];
  const Number f = dot(q, h) - q[2] * 2.0;
  h[2] = h[2] - 1.0;
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
    Kh[i] = h[i] * k[i];
  const Number hh = dot(h, h);
  const Number squared = larger(hh * hh - f * dot(h, Kh), Number(0.0));
  const Number t = f / (hh + squareRoot(squared));
  return t * t * hh;
}

// n^T S n.
HOLDFAST_INLINE Number
varianceAlong(const double n[3], const Number S[6])
{
  return S[0] * (n[0] * n[0]) + S[3] * (n[1] * n[1]) + S[5] * (n[2] * n[2]) +
         S[1] * (2.0 * n[0] * n[1]) + S[2] * (2.0 * n[0] * n[2]) +
         S[4] * (2.0 * n[1] * n[2]);
}

inline void
placePoints(const Points& points, const PatchForm& patch, const PlacedPoints& out)
{
  const double normal[3] = {patch.R[2], patch.R[5], patch.R[8]};
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Number offset[3], q[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      offset[k] = load(points.channel[k] + i) - patch.c[k];
    rotateIntoFrame(patch.R, offset, q);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      store(q[k], out.q[k] + i);
    store(reachOf(patch.boundary, q[0], q[1]), out.reach + i);
    store(squaredDistance(patch.k, q), out.squared_distance + i);
    Number S[6];
    loadCovariance(points, i, S);
    store(varianceAlong(normal, S), out.variance + i);
  }
}

struct CovarianceAction {
  const Points& points;
  const State& state;
  CovarianceSums& sums;

  template <typename Surface, typename ResidualPolicy>
  void run() const
  {
    covarianceSums<Surface, ResidualPolicy>(points, state, sums);
  }
};

struct ResidualAction {
  const Points& points;
  const State& state;
  double* out;

  template <typename Surface, typename ResidualPolicy>
  void run() const
  {
    residualsOfPoints<Surface, ResidualPolicy>(points, state, out);
  }
};

inline void
accumulateCovariance(Model model,
                     Residual residual,
                     const Points& points,
                     const State& state,
                     CovarianceSums& sums)
{
  if (!accumulateByFeet(model, residual, points, state, sums))
    forSurfaceAndResidual(model, residual, CovarianceAction{points, state, sums});
}

inline void
squaredResiduals(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 double* out)
{
  forSurfaceAndResidual(model, residual, ResidualAction{points, state, out});
}

// t > 0 where o + t d of the surface lies within the bounds, else `instead`.
HOLDFAST_INLINE Number
meetAt(const PatchForm& patch,
       double curvature,
       const double o[3],
       const Number d[3],
       Number t,
       Number instead)
{
  const Number x = t * d[0] + o[0], y = t * d[1] + o[1], z = t * d[2] + o[2];
  const Number edge(BoundaryForm::kEdge), one(1.0 + 1e-12), zero(0.0);
  // Beyond the equator the surface is none of the patch's.
  Number found = selectLess(edge, reachOf(patch.boundary, x, y), instead, t);
  found = selectLess(one, z * curvature, instead, found);
  return selectLess(zero, t, found, instead);
}

inline void
meetRays(const double* x,
         const double* y,
         int count,
         const PatchForm& patch,
         double curvature,
         double* inverse_depth)
{
  const double *R = patch.R, *c = patch.c, *k = patch.k;
  double o[3], half_gradient[3], C = 0.0;
  for (int i = 0; i < 3; ++i) {
    o[i] = -(R[i] * c[0] + R[3 + i] * c[1] + R[6 + i] * c[2]);
    half_gradient[i] = k[i] * o[i] - (i == 2 ? 1.0 : 0.0);
    C += k[i] * o[i] * o[i];
  }
  C -= 2.0 * o[2];
  for (int i = 0; i < count; i += kLanes) {
    const Number ray[3] = {loadAnywhere(x + i), loadAnywhere(y + i), Number(1.0)};
    Number d[3];
    rotateIntoFrame(R, ray, d);
    // f(o + t d) = A t^2 + 2 B t + C with f of paper eq. (1).
    const Number A = d[0] * d[0] * k[0] + d[1] * d[1] * k[1] + d[2] * d[2] * k[2];
    const Number B =
        d[0] * half_gradient[0] + d[1] * half_gradient[1] + d[2] * half_gradient[2];
    const Number zero(0.0), D = B * B - A * C;
    const Number root = squareRoot(larger(D, zero));
    // The root of larger magnitude does not cancel; the other one follows from their
    // product, which covers A = 0 as well.
    const Number q = selectLess(B, zero, root - B, zero - root - B);
    const Number first = selectLess(q * q, Number(1e-300), zero, C / q);
    const Number second = selectLess(A * A, Number(1e-300), first, q / A);
    const Number near = selectLess(first, second, first, second);
    const Number far = larger(first, second);
    Number t = meetAt(patch, curvature, o, d, far, zero);
    t = meetAt(patch, curvature, o, d, near, t);
    t = selectLess(D, zero, zero, t);
    store(selectLess(zero, t, 1.0 / larger(t, Number(1e-300)), zero),
          inverse_depth + i);
  }
}

#include "kernel_pattern.inl"

// ---- Small matrices ---------------------------------------------------------------

constexpr int kSmallNumbers = kSmallRow / kLanes;

// Row a of n numbers times n rows of B.
HOLDFAST_INLINE void
multiplyRow(const double* a, int n, const double* B, double* out)
{
  Number sum[kSmallNumbers];
  for (Number& entry : sum)
    entry = Number(0.0);
  for (int k = 0; k < n; ++k) {
    const Number factor(a[k]);
    for (int i = 0; i < kSmallNumbers; ++i)
      sum[i] = sum[i] + factor * load(B + k * kSmallRow + i * kLanes);
  }
  for (int i = 0; i < kSmallNumbers; ++i)
    store(sum[i], out + i * kLanes);
}

inline void
congruence(const double* J, int n, const double* S, int m, double* out)
{
  alignas(64) double transposed[kSmallRow][kSmallRow];
  alignas(64) double JS[kSmallRow];
  for (int k = 0; k < m; ++k)
    for (int i = 0; i < kSmallRow; ++i)
      transposed[k][i] = i < n ? J[i * kSmallRow + k] : 0.0;
  for (int i = 0; i < n; ++i) {
    multiplyRow(J + i * kSmallRow, m, S, JS);
    multiplyRow(JS, m, transposed[0], out + i * kSmallRow);
  }
}
