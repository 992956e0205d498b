// The per-point mathematics of the fit, for any number type. No include guard: this
// file is included once for every instruction set, inside that set's namespace, after
// the definition of
//
//   Number                    arithmetic type with + - * / among itself and with double
//   kLanes                    points per Number
//   load(const double*)       kLanes consecutive doubles
//   store(Number, double*)    the reverse
//   sumOfLanes(Number)        their sum
//   squareRoot(Number)
//   selectLess(a, b, x, y)    a < b ? x : y, lane by lane
//   allLess(a, b)             a < b in every lane
//   HOLDFAST_INLINE           before functions of the hot loop
//   HOLDFAST_UNROLLED_FOR     `for` of constant length, whose arrays then live in
//                             registers
//
// The notation is that of fit/kernel.h.

HOLDFAST_INLINE Number
dot(const Number a[3], const Number b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// S v for a symmetric S = xx xy xz yy yz zz.
HOLDFAST_INLINE void
multiply(const Number S[6], const Number v[3], Number out[3])
{
  out[0] = S[0] * v[0] + S[1] * v[1] + S[2] * v[2];
  out[1] = S[1] * v[0] + S[3] * v[1] + S[4] * v[2];
  out[2] = S[2] * v[0] + S[4] * v[1] + S[5] * v[2];
}

// Coordinates and covariance, as they are in the batch.
HOLDFAST_INLINE void
loadPoint(const Points& points, int i, Number q[3], Number S[6])
{
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    q[k] = load(points.channel[k] + i);
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 6; ++k)
    S[k] = load(points.channel[3 + k] + i);
}

// R^T v.
HOLDFAST_INLINE void
rotateIntoFrame(const double R[9], const Number v[3], Number out[3])
{
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
    out[i] = v[0] * R[i] + v[1] * R[3 + i] + v[2] * R[6 + i];
}

// R^T S R.
HOLDFAST_INLINE void
rotateCovarianceIntoFrame(const double R[9], const Number S[6], Number out[6])
{
  Number SR[3][3]; // row i: (S R)(:, i)
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i) {
    SR[i][0] = S[0] * R[i] + S[1] * R[3 + i] + S[2] * R[6 + i];
    SR[i][1] = S[1] * R[i] + S[3] * R[3 + i] + S[4] * R[6 + i];
    SR[i][2] = S[2] * R[i] + S[4] * R[3 + i] + S[5] * R[6 + i];
  }
  const int row[6] = {0, 0, 0, 1, 1, 2};
  const int column[6] = {0, 1, 2, 1, 2, 2};
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e)
    out[e] = SR[column[e]][0] * R[row[e]] + SR[column[e]][1] * R[3 + row[e]] +
             SR[column[e]][2] * R[6 + row[e]];
}

// R v.
HOLDFAST_INLINE void
rotateOutOfFrame(const double R[9], const Number v[3], Number out[3])
{
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
    out[i] = v[0] * R[3 * i] + v[1] * R[3 * i + 1] + v[2] * R[3 * i + 2];
}

// ---- Polynomials in q: 1 x y z xx yy zz xy xz yz ------------------------------------

// v^T (hess p) v / 2 of each: the quadratic ones at v.
HOLDFAST_INLINE void
quadraticMonomials(const Number v[3], Number p[kPolynomials])
{
  p[P1] = p[PX] = p[PY] = p[PZ] = Number(0.0);
  p[PXX] = v[0] * v[0], p[PYY] = v[1] * v[1], p[PZZ] = v[2] * v[2];
  p[PXY] = v[0] * v[1], p[PXZ] = v[0] * v[2], p[PYZ] = v[1] * v[2];
}

HOLDFAST_INLINE void
monomials(const Number q[3], Number p[kPolynomials])
{
  quadraticMonomials(q, p);
  p[P1] = Number(1.0), p[PX] = q[0], p[PY] = q[1], p[PZ] = q[2];
}

// Row `axis` of (hess p) v of each.
HOLDFAST_INLINE void
hessianRow(int axis, const Number v[3], Number p[kPolynomials])
{
  const Number zero(0.0);
  p[P1] = p[PX] = p[PY] = p[PZ] = zero;
  p[PXX] = axis == 0 ? v[0] * 2.0 : zero;
  p[PYY] = axis == 1 ? v[1] * 2.0 : zero;
  p[PZZ] = axis == 2 ? v[2] * 2.0 : zero;
  p[PXY] = axis == 0 ? v[1] : axis == 1 ? v[0] : zero;
  p[PXZ] = axis == 0 ? v[2] : axis == 2 ? v[0] : zero;
  p[PYZ] = axis == 1 ? v[2] : axis == 2 ? v[1] : zero;
}

// Component `axis` of grad p at q of each.
HOLDFAST_INLINE void
gradientComponent(int axis, const Number q[3], Number p[kPolynomials])
{
  hessianRow(axis, q, p);
  p[PX + axis] = Number(1.0);
}

// f p + mu.grad p + w t^T (hess p) t / 2 of each: how a function of f, g and G with
// these derivatives changes as f grows by p.
HOLDFAST_INLINE void
changeAlong(const Number q[3],
            const Number t[3],
            Number f,
            const Number mu[3],
            Number w,
            Number p[kPolynomials])
{
  const Number x = q[0], y = q[1], z = q[2];
  const Number fx = f * x, fy = f * y, fz = f * z;
  const Number wx = w * t[0], wy = w * t[1], wz = w * t[2];
  p[P1] = f;
  p[PX] = fx + mu[0];
  p[PY] = fy + mu[1];
  p[PZ] = fz + mu[2];
  p[PXX] = x * (p[PX] + mu[0]) + wx * t[0];
  p[PYY] = y * (p[PY] + mu[1]) + wy * t[1];
  p[PZZ] = z * (p[PZ] + mu[2]) + wz * t[2];
  p[PXY] = x * p[PY] + y * mu[0] + wx * t[1];
  p[PXZ] = x * p[PZ] + z * mu[0] + wx * t[2];
  p[PYZ] = y * p[PZ] + z * mu[1] + wy * t[2];
}

// ---- Surfaces: G v, and f_a of every parameter as a combination of polynomials ------
//
// Whatever is linear in f (B_a, G_a, L[f_a], the derivative of a residual) is combined
// in the same way from its values for the polynomials.

struct ParaboloidSurface {
  static constexpr Model kModel = Model::Paraboloid;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number v[3], Number out[3]) const
  {
    out[0] = v[0] * (2.0 * s.k[0]) + v[1] * (2.0 * s.k[1]);
    out[1] = v[0] * (2.0 * s.k[1]) + v[1] * (2.0 * s.k[2]);
    out[2] = Number(0.0);
  }

  // delta: (g x q)_x, (g x q)_y; a: -g.line.
  template <typename T>
  HOLDFAST_INLINE void combine(const T p[kPolynomials], T f[]) const
  {
    const double xx = 2.0 * s.k[0], xy = 2.0 * s.k[1], yy = 2.0 * s.k[2];
    f[0] = p[PXX];
    f[1] = p[PXY] * 2.0;
    f[2] = p[PYY];
    f[3] = p[PXZ] * xy + p[PYZ] * yy + p[PY] * 2.0;
    f[4] = p[PXZ] * -xx + p[PYZ] * -xy + p[PX] * -2.0;
    f[5] = p[PX] * -(xx * s.line[0] + xy * s.line[1]) +
           p[PY] * -(xy * s.line[0] + yy * s.line[1]) + p[P1] * (2.0 * s.line[2]);
  }
};

struct SphereSurface {
  static constexpr Model kModel = Model::Sphere;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number v[3], Number out[3]) const
  {
    HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
      out[i] = v[i] * (2.0 * s.k[0]);
  }

  // c: -g.
  template <typename T>
  HOLDFAST_INLINE void combine(const T p[kPolynomials], T f[]) const
  {
    const double k = 2.0 * s.k[0];
    f[0] = p[PXX] + p[PYY] + p[PZZ];
    f[1] = p[PX] * -k;
    f[2] = p[PY] * -k;
    f[3] = p[PZ] * -k + p[P1] * 2.0;
  }
};

struct CylinderSurface {
  static constexpr Model kModel = Model::Cylinder;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number v[3], Number out[3]) const
  {
    out[0] = Number(0.0);
    out[1] = v[1] * (2.0 * s.k[0]);
    out[2] = v[2] * (2.0 * s.k[0]);
  }

  // delta: (g x q)_y, (g x q)_z; c: -g_y, -g_z.
  template <typename T>
  HOLDFAST_INLINE void combine(const T p[kPolynomials], T f[]) const
  {
    const double k = 2.0 * s.k[0];
    f[0] = p[PYY] + p[PZZ];
    f[1] = p[PXZ] * k + p[PX] * -2.0;
    f[2] = p[PXY] * -k;
    f[3] = p[PY] * -k;
    f[4] = p[PZ] * -k + p[P1] * 2.0;
  }
};

struct PlaneSurface {
  static constexpr Model kModel = Model::Plane;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number*, Number out[3]) const
  {
    out[0] = out[1] = out[2] = Number(0.0);
  }

  // delta: (g x q)_x, (g x q)_y; c_z: -g_z.
  template <typename T>
  HOLDFAST_INLINE void combine(const T p[kPolynomials], T f[]) const
  {
    f[0] = p[PY] * 2.0;
    f[1] = p[PX] * -2.0;
    f[2] = p[P1] * 2.0;
  }
};

// ---- Residuals: E(f, V, w) = e^2 / 2 ------------------------------------------------

// sqrt(V) times the residual e and its gradient.
struct ScaledResidual {
  Number e, f, V, w;
};

struct SecondPartials {
  Number ff, fV, VV, fw, Vw, ww; // of E
};

// e = f / sqrt(V). The weight, 0 or 1, is that of padding and points.
struct SampsonResidual {
  static constexpr bool kUsesCurvature = false;
  Number inverse, h, residual;

  HOLDFAST_INLINE SampsonResidual(Number f, Number V, Number, Number weight)
  : inverse(weight / V), h(f * inverse), residual(f)
  {}

  HOLDFAST_INLINE ScaledResidual first() const
  {
    return {residual, Number(1.0), h * -0.5, Number(0.0)};
  }

  HOLDFAST_INLINE SecondPartials second() const
  {
    const Number zero(0.0);
    return {inverse, h * inverse * -1.0, h * h * inverse, zero, zero, zero};
  }
};

// e = phi(tau) f / sqrt(V), tau = 4 f w / V^2, phi = 2 / (1 + s), s = sqrt(1 - tau):
// the Mahalanobis distance to the foot on the ray q - t Sigma g. Where the ray all but
// misses the surface, 1 - tau < 1/4, s continues as (1/4)/(3/4 - (1 - tau)), which
// meets the root in value and slope and stays positive.
struct RayResidual {
  static constexpr bool kUsesCurvature = true;
  Number inverse, h, residual, tau;
  Number phi, phi1, phi2; // phi and its first two derivatives

  HOLDFAST_INLINE RayResidual(Number f, Number V, Number w, Number weight)
  : inverse(weight / V), h(f * inverse), tau(h * w * inverse * 4.0)
  {
    const Number x = 1.0 - tau, quarter(0.25);
    const Number hit = squareRoot(selectLess(x, quarter, quarter, x));
    const Number over = 1.0 / selectLess(x, quarter, 0.75 - x, hit);
    const Number s = selectLess(x, quarter, over * 0.25, hit);
    // Hit: s' = -1/(2s), s'' = -1/(4 s^3). Miss, y = 1/(3/4 - x): -y^2/4, y^3/2.
    const Number s1 = selectLess(x, quarter, over * over * -0.25, over * -0.5);
    const Number s2 =
        over * over * over * selectLess(x, quarter, Number(0.5), Number(-0.25));
    phi = 2.0 / (1.0 + s);
    phi1 = phi * phi * s1 * -0.5;
    phi2 = phi * phi * (phi * s1 * s1 - s2) * 0.5;
    residual = phi * f;
  }

  HOLDFAST_INLINE ScaledResidual first() const
  {
    const Number slope = tau * phi1;
    return {residual, phi + slope, h * (phi * -0.5 - slope * 2.0), h * h * phi1 * 4.0};
  }

  HOLDFAST_INLINE SecondPartials second() const
  {
    const Number Phi = phi * phi, Phi1 = phi * phi1 * 2.0;
    const Number half_Phi2 = phi1 * phi1 + phi * phi2;
    const Number tau_Phi2 = tau * half_Phi2 * 2.0;
    const Number h2 = h * h * inverse;
    return {inverse * (Phi + tau * (Phi1 * 2.0 + tau_Phi2 * 0.5)),
            h * inverse * (Phi + tau * (Phi1 * 3.5 + tau_Phi2)) * -1.0,
            h2 * (Phi + tau * (Phi1 * 5.0 + tau_Phi2 * 2.0)),
            h2 * (Phi1 * 3.0 + tau_Phi2) * 2.0,
            h2 * h * (Phi1 * 3.0 + tau_Phi2 * 2.0) * -2.0,
            h2 * h * h * half_Phi2 * 16.0};
  }
};

// ---- One point --------------------------------------------------------------------

// Sigma of a point as it is in the batch: cheaper for a product or two.
struct BatchNoise {
  const double* R;
  Number S[6];

  HOLDFAST_INLINE void enter(const double frame[9], const Number batch[6])
  {
    R = frame;
    HOLDFAST_UNROLLED_FOR (int e = 0; e < 6; ++e)
      S[e] = batch[e];
  }

  HOLDFAST_INLINE void apply(const Number v[3], Number out[3]) const
  {
    Number outside[3], noisy[3];
    rotateOutOfFrame(R, v, outside);
    multiply(S, outside, noisy);
    rotateIntoFrame(R, noisy, out);
  }
};

// Sigma of a point brought into the local frame.
struct LocalNoise {
  Number S[6];

  HOLDFAST_INLINE void enter(const double frame[9], const Number batch[6])
  {
    rotateCovarianceIntoFrame(frame, batch, S);
  }

  HOLDFAST_INLINE void apply(const Number v[3], Number out[3]) const
  {
    multiply(S, v, out);
  }
};

// A point seen from the local frame.
template <typename Noise>
struct Local {
  Noise noise;
  Number q[3], weight;
  Number g[3], t[3], Gt[3], r[3];
  Number f, V, w;
};

template <typename ResidualPolicy, typename Surface, typename Noise>
HOLDFAST_INLINE void
enterFrame(const Surface& surface, const Points& points, int i, Local<Noise>& p)
{
  const State& state = surface.s;
  Number offset[3], S[6];
  loadPoint(points, i, offset, S);
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    offset[k] = offset[k] - state.c[k];
  p.weight = load(points.channel[9] + i);
  rotateIntoFrame(state.R, offset, p.q);
  p.noise.enter(state.R, S);
  surface.applyG(p.q, p.g);
  p.g[2] = p.g[2] - 2.0;
  p.noise.apply(p.g, p.t);
  // Padding has Sigma = 0 and weight 0: keep its V away from zero.
  p.V = dot(p.g, p.t) + (1.0 - p.weight);
  p.f = dot(p.q, p.g) * 0.5 - p.q[2];
  surface.applyG(p.t, p.Gt);
  p.r[0] = p.r[1] = p.r[2] = p.w = Number(0.0);
  if (ResidualPolicy::kUsesCurvature) {
    p.noise.apply(p.Gt, p.r);
    p.w = dot(p.t, p.Gt) * 0.5;
  }
}

// 2 V' t + w' r: derivative with respect to g of what has derivatives V', w'.
template <typename Noise>
HOLDFAST_INLINE void
slopeInG(const Local<Noise>& p, Number V, Number w, Number mu[3])
{
  HOLDFAST_UNROLLED_FOR (int i = 0; i < 3; ++i)
    mu[i] = p.t[i] * (V * 2.0) + p.r[i] * w;
}

// f_a, B_a, G_a t and t^T G_a t / 2 of every parameter.
template <typename Surface>
struct SurfaceDerivatives {
  static constexpr int kCount = parameterCount(Surface::kModel);
  Number f[kCount], B[kCount][3], Gt[kCount][3], tGt[kCount];

  HOLDFAST_INLINE
  SurfaceDerivatives(const Surface& surface, const Number q[3], const Number t[3])
  {
    Number p[kPolynomials], column[kCount];
    monomials(q, p);
    surface.combine(p, f);
    quadraticMonomials(t, p);
    surface.combine(p, tGt);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
      gradientComponent(k, q, p);
      surface.combine(p, column);
      HOLDFAST_UNROLLED_FOR (int a = 0; a < kCount; ++a)
        B[a][k] = column[a];
      hessianRow(k, t, p);
      surface.combine(p, column);
      HOLDFAST_UNROLLED_FOR (int a = 0; a < kCount; ++a)
        Gt[a][k] = column[a];
    }
  }
};

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

// ---- The sums ---------------------------------------------------------------------

template <typename Sums>
HOLDFAST_INLINE void
setZero(Sums& sums)
{
  Number* entry = reinterpret_cast<Number*>(&sums);
  for (unsigned i = 0; i < sizeof(Sums) / sizeof(Number); ++i)
    entry[i] = Number(0.0);
}

template <int n>
HOLDFAST_INLINE void
copy(const Number (&from)[n], Number (&to)[n])
{
  HOLDFAST_UNROLLED_FOR (int i = 0; i < n; ++i)
    to[i] = from[i];
}

// Sums over the lanes of accumulators.
template <int n>
HOLDFAST_INLINE void
reduce(const Number (&sums)[n], double* out)
{
  for (int i = 0; i < n; ++i)
    out[i] = sumOfLanes(sums[i]);
}

// Blocks of points between two steps of the work on them. In one step per block, the
// accumulators would not fit the registers, and divisions and roots would be waited
// for; a tile stays in the first cache.
constexpr int kTile = 8;

HOLDFAST_INLINE int
tileSize(const Points& points, int first)
{
  return std::min(kTile, (points.padded_size - first) / kLanes);
}

template <int p>
struct NormalSlot {
  Number q[3], t[3];
  Number e, f, mu[3], w; // sqrt(V) times the residual, derivatives in f, g and G
  Number inverse; // 1 / V
  Number J[p];
};

template <int p>
struct NormalAccumulators {
  Number cost, L[kPolynomials], JtJ[p * (p + 1) / 2];
};

template <typename ResidualPolicy, typename Surface, int p>
HOLDFAST_INLINE void
fillSlot(const Surface& surface, const Points& points, int i, NormalSlot<p>& slot)
{
  Local<BatchNoise> local;
  enterFrame<ResidualPolicy>(surface, points, i, local);
  const ResidualPolicy residual(local.f, local.V, local.w, local.weight);
  const ScaledResidual e = residual.first();
  copy(local.q, slot.q), copy(local.t, slot.t);
  slot.e = e.e, slot.f = e.f, slot.w = e.w;
  slot.inverse = residual.inverse;
  slopeInG(local, e.V, e.w, slot.mu);
}

// Adds to the cost and to L, and leaves J in the tile. L[p] = e e[p], and J, both come
// from e[p], the change of e along p.
template <typename Surface, int p>
HOLDFAST_INLINE void
addGradient(const Surface& surface,
            NormalSlot<p>* tile,
            int size,
            NormalAccumulators<p>& sums)
{
  Number cost = sums.cost, L[kPolynomials];
  copy(sums.L, L);
  for (NormalSlot<p>* slot = tile; slot != tile + size; ++slot) {
    const Number scale = slot->inverse * slot->e;
    Number change[kPolynomials];
    changeAlong(slot->q, slot->t, slot->f, slot->mu, slot->w, change);
    cost = cost + scale * slot->e * 0.5;
    HOLDFAST_UNROLLED_FOR (int k = 0; k < kPolynomials; ++k)
      L[k] = L[k] + scale * change[k];
    surface.combine(change, slot->J);
  }
  sums.cost = cost;
  copy(L, sums.L);
}

template <int p>
HOLDFAST_INLINE void
addJtJ(const NormalSlot<p>* tile, int size, NormalAccumulators<p>& sums)
{
  Number JtJ[p * (p + 1) / 2];
  copy(sums.JtJ, JtJ);
  for (const NormalSlot<p>* slot = tile; slot != tile + size; ++slot) {
    HOLDFAST_UNROLLED_FOR (int a = 0; a < p; ++a) {
      const Number J_over_V = slot->J[a] * slot->inverse;
      HOLDFAST_UNROLLED_FOR (int b = a; b < p; ++b)
        JtJ[packed(a, b, p)] = JtJ[packed(a, b, p)] + J_over_V * slot->J[b];
    }
  }
  copy(JtJ, sums.JtJ);
}

template <typename Surface, typename ResidualPolicy>
void
normalSums(const Points& points, const State& state, NormalSums& out)
{
  constexpr int p = parameterCount(Surface::kModel);
  const Surface surface{state};
  NormalAccumulators<p> sums;
  setZero(sums);
  NormalSlot<p> tile[kTile];
  for (int first = 0; first < points.padded_size; first += kTile * kLanes) {
    const int size = tileSize(points, first);
    for (int i = 0; i < size; ++i)
      fillSlot<ResidualPolicy>(surface, points, first + i * kLanes, tile[i]);
    addGradient(surface, tile, size, sums);
    addJtJ(tile, size, sums);
  }
  double L[kPolynomials];
  reduce(sums.L, L);
  surface.combine(L, out.gradient);
  out.cost = sumOfLanes(sums.cost);
  reduce(sums.JtJ, out.JtJ);
}

// A tile of the covariance pass.
template <int p>
struct Tile {
  int size;
  Expansion point[kTile];
  Number qt[kTile][3], X[kTile][p][3];
};

template <int p, int shape>
struct CovarianceAccumulators {
  Number cost, L[kPolynomials], H[shape * (shape + 1) / 2];
  Number X[p][3], XX[p * (p + 1) / 2], XS[p][3], XSq[p][6];
  Number S[6], qS[3][6], qqS[6][6];
};

template <int p, int shape>
void
reduce(const CovarianceAccumulators<p, shape>& sums, CovarianceSums& out)
{
  out.cost = sumOfLanes(sums.cost);
  reduce(sums.L, out.L);
  reduce(sums.H, out.H);
  reduce(sums.XX, out.XX);
  for (int a = 0; a < p; ++a) {
    reduce(sums.X[a], out.X[a]);
    reduce(sums.XS[a], out.XS[a]);
    reduce(sums.XSq[a], out.XSq[a]);
    for (const int diagonal : {0, 3, 5})
      out.XSq[a][diagonal] *= 2.0; // summed once
  }
  reduce(sums.S, out.S);
  for (int k = 0; k < 3; ++k)
    reduce(sums.qS[k], out.qS[k]);
  for (int pair = 0; pair < 6; ++pair)
    reduce(sums.qqS[pair], out.qqS[pair]);
}

// Adds row a of H, and leaves X_a in the tile.
template <int a, typename ResidualPolicy, typename Surface, int p, int shape>
HOLDFAST_INLINE void
addHessianRow(const Surface& surface,
              Tile<p>& tile,
              CovarianceAccumulators<p, shape>& sums)
{
  constexpr int columns = a < shape ? a + 1 : 0;
  Number H[columns + 1];
  HOLDFAST_UNROLLED_FOR (int b = 0; b < columns; ++b)
    H[b] = sums.H[packed(b, a, shape)];
  for (int i = 0; i < tile.size; ++i) {
    const Expansion& point = tile.point[i];
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

// Sums over a tile of what X_a is multiplied with.
template <int a, int p, int shape>
HOLDFAST_INLINE void
addCrossRow(const Tile<p>& tile, CovarianceAccumulators<p, shape>& sums)
{
  constexpr int first = packed(a, a, p);
  Number X[3], XS[3], XSq[6], XX[p - a];
  copy(sums.X[a], X), copy(sums.XS[a], XS), copy(sums.XSq[a], XSq);
  HOLDFAST_UNROLLED_FOR (int b = a; b < p; ++b)
    XX[b - a] = sums.XX[first + b - a];
  for (int i = 0; i < tile.size; ++i) {
    const Number* qt = tile.qt[i];
    Number noisy[3];
    multiply(tile.point[i].noise.S, tile.X[i][a], noisy);
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
addMoments(int e, const Tile<p>& tile, CovarianceAccumulators<p, shape>& sums)
{
  Number S = sums.S[e], qS[3], qqS[6];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    qS[k] = sums.qS[k][e];
  HOLDFAST_UNROLLED_FOR (int pair = 0; pair < 6; ++pair)
    qqS[pair] = sums.qqS[pair][e];
  for (int i = 0; i < tile.size; ++i) {
    S = S + tile.point[i].noise.S[e];
    HOLDFAST_UNROLLED_FOR (int a = 0, pair = 0; a < 3; ++a) {
      const Number product = tile.qt[i][a] * tile.point[i].noise.S[e];
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
sharePattern(const Points& points, const State& state, int first, Tile<p>& tile)
{
  const PatternPoints& pattern = *points.pattern;
  for (int i = 0; i < tile.size; ++i) {
    const int at = first + i * kLanes;
    Number r[3], outside[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      outside[k] = load(pattern.direction[k] + at);
    rotateIntoFrame(state.R, outside, r);
    HOLDFAST_UNROLLED_FOR (int a = 0; a < p; ++a)
      store(dot(tile.X[i][a], r), pattern.response + a * points.padded_size + at);
    const Number extra = load(pattern.extra + at);
    Number* S = tile.point[i].noise.S;
    HOLDFAST_UNROLLED_FOR (int b = 0, pair = 0; b < 3; ++b)
      HOLDFAST_UNROLLED_FOR (int c = b; c < 3; ++c, ++pair)
        S[pair] = S[pair] + extra * r[b] * r[c];
  }
}

template <typename ResidualPolicy, typename Surface, int p, int shape, int... a>
HOLDFAST_INLINE void
addTile(const Surface& surface,
        const Points& points,
        int first,
        Tile<p>& tile,
        CovarianceAccumulators<p, shape>& sums,
        std::integer_sequence<int, a...>)
{
  (addHessianRow<a, ResidualPolicy>(surface, tile, sums), ...);
  if (points.pattern != nullptr)
    sharePattern(points, surface.s, first, tile);
  (addCrossRow<a>(tile, sums), ...);
  for (int e = 0; e < 6; ++e)
    addMoments(e, tile, sums);
}

template <typename Surface, typename ResidualPolicy>
void
covarianceSums(const Points& points, const State& state, CovarianceSums& out)
{
  constexpr int p = parameterCount(Surface::kModel);
  constexpr int shape = shapeParameterCount(Surface::kModel);
  const Surface surface{state};
  CovarianceAccumulators<p, shape> sums;
  setZero(sums);
  Tile<p> tile;
  for (int first = 0; first < points.padded_size; first += kTile * kLanes) {
    tile.size = tileSize(points, first);
    for (int i = 0; i < tile.size; ++i)
      enterFrame<ResidualPolicy>(surface, points, first + i * kLanes, tile.point[i]);
    for (int i = 0; i < tile.size; ++i) {
      Expansion& point = tile.point[i];
      point.expand<ResidualPolicy>();
      sums.cost = sums.cost + point.E;
      Number L[kPolynomials];
      changeAlong(point.q, point.t, point.E_f, point.mu, point.E_w, L);
      HOLDFAST_UNROLLED_FOR (int k = 0; k < kPolynomials; ++k)
        sums.L[k] = sums.L[k] + L[k];
      HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
        tile.qt[i][k] = point.q[k] - state.centroid[k];
    }
    addTile<ResidualPolicy>(surface,
                            points,
                            first,
                            tile,
                            sums,
                            std::make_integer_sequence<int, p>());
  }
  reduce(sums, out);
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
larger(Number a, Number b)
{
  return selectLess(a, b, b, a);
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

inline void
placePoints(const Points& points, const PatchForm& patch, const PlacedPoints& out)
{
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Number offset[3], q[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      offset[k] = load(points.channel[k] + i) - patch.c[k];
    rotateIntoFrame(patch.R, offset, q);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
      store(q[k], out.q[k] + i);
    store(reachOf(patch.boundary, q[0], q[1]), out.reach + i);
    store(squaredDistance(patch.k, q), out.squared_distance + i);
  }
}

// ---- Choice of surface and residual -----------------------------------------------

// Calls action.run<Surface, ResidualPolicy>() for the surface and residual named.
template <typename ResidualPolicy, typename Action>
void
forSurface(Model model, const Action& action)
{
  switch (model) {
  case Model::Paraboloid:
    return action.template run<ParaboloidSurface, ResidualPolicy>();
  case Model::Sphere:
    return action.template run<SphereSurface, ResidualPolicy>();
  case Model::Cylinder:
    return action.template run<CylinderSurface, ResidualPolicy>();
  case Model::Plane:
    // A plane has no curvature: the two residuals are one.
    return action.template run<PlaneSurface, SampsonResidual>();
  }
}

template <typename Action>
void
forSurfaceAndResidual(Model model, Residual residual, const Action& action)
{
  if (residual == Residual::Ray)
    forSurface<RayResidual>(model, action);
  else
    forSurface<SampsonResidual>(model, action);
}

struct NormalAction {
  const Points& points;
  const State& state;
  NormalSums& sums;

  template <typename Surface, typename ResidualPolicy>
  void run() const
  {
    normalSums<Surface, ResidualPolicy>(points, state, sums);
  }
};

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
accumulateNormal(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 NormalSums& sums)
{
  forSurfaceAndResidual(model, residual, NormalAction{points, state, sums});
}

inline void
accumulateCovariance(Model model,
                     Residual residual,
                     const Points& points,
                     const State& state,
                     CovarianceSums& sums)
{
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

// ---- Sums over the cells of a grid
// ---------------------------------------------------
//
// C does not change when both cells are mirrored, so that what is even about a middle
// line of the grid and what is odd have no covariance: four sums over a quarter of the
// cells, each with itself, in place of one over all pairs.

constexpr int kHalf = kCells / 2;
constexpr int kQuarter = kHalf * kHalf;
constexpr int kRowNumbers = kCellRow / kLanes;

// y of the quarter, even (sign 1) or odd (-1) about the middle row and column.
HOLDFAST_INLINE void
foldCells(const CellSums& cells,
          double row_sign,
          double column_sign,
          double folded[kQuarter][kCellRow])
{
  for (int row = 0; row < kHalf; ++row)
    for (int column = 0; column < kHalf; ++column) {
      const int mirrored = kCells - 1 - column, below = kCells - 1 - row;
      const double* at = cells.y[row * kCells + column];
      const double* right = cells.y[row * kCells + mirrored];
      const double* down = cells.y[below * kCells + column];
      const double* across = cells.y[below * kCells + mirrored];
      for (int i = 0; i < kCellRow; i += kLanes)
        store(load(at + i) + load(right + i) * column_sign +
                  (load(down + i) + load(across + i) * column_sign) * row_sign,
              folded[row * kHalf + column] + i);
    }
}

// Their covariance with each other: folded over the rows, then over the columns.
inline void
foldCovariance(const CellSums& cells,
               double row_sign,
               double column_sign,
               double folded[kQuarter][kQuarter])
{
  for (int row = 0; row < kHalf; ++row)
    for (int other_row = 0; other_row < kHalf; ++other_row) {
      const double* near =
          cells.covariance[row > other_row ? row - other_row : other_row - row];
      const double* far = cells.covariance[kCells - 1 - row - other_row];
      double C[kCells];
      for (int across = 0; across < kCells; ++across)
        C[across] = near[across] + row_sign * far[across];
      for (int a = 0; a < kHalf; ++a)
        for (int b = 0; b < kHalf; ++b)
          folded[row * kHalf + a][other_row * kHalf + b] =
              C[a > b ? a - b : b - a] + column_sign * C[kCells - 1 - a - b];
    }
}

// sum_ab y_a C_ab y_b^T, a quarter of it (foldCells() counts y twice in each
// direction).
HOLDFAST_INLINE void
addQuarter(const double y[kQuarter][kCellRow],
           const double C[kQuarter][kQuarter],
           Number sum[kCellRow][kRowNumbers])
{
  for (int a = 0; a < kQuarter; ++a) {
    Number weighted[kRowNumbers];
    for (int i = 0; i < kRowNumbers; ++i)
      weighted[i] = Number(0.0);
    for (int b = 0; b < kQuarter; ++b)
      for (int i = 0; i < kRowNumbers; ++i)
        weighted[i] = weighted[i] + load(y[b] + i * kLanes) * (0.25 * C[a][b]);
    for (int row = 0; row < kCellRow; ++row)
      for (int i = 0; i < kRowNumbers; ++i)
        sum[row][i] = sum[row][i] + weighted[i] * y[a][row];
  }
}

inline void
sumOverCells(const CellSums& cells, double* out)
{
  Number sum[kCellRow][kRowNumbers];
  for (auto& row : sum)
    for (Number& entry : row)
      entry = Number(0.0);
  alignas(64) double y[kQuarter][kCellRow];
  double C[kQuarter][kQuarter];
  for (const double row_sign : {1.0, -1.0})
    for (const double column_sign : {1.0, -1.0}) {
      foldCells(cells, row_sign, column_sign, y);
      foldCovariance(cells, row_sign, column_sign, C);
      addQuarter(y, C, sum);
    }
  for (int row = 0; row < kCellRow; ++row)
    for (int i = 0; i < kRowNumbers; ++i)
      store(sum[row][i], out + row * kCellRow + i * kLanes);
}

// ---- The table --------------------------------------------------------------------

// The functions above as callers see them, of the instruction set this file is being
// compiled for.
constexpr Kernel
makeKernel(const char* instruction_set)
{
  return {instruction_set,
          accumulateScatter,
          accumulateQuadric,
          moveOntoQuadric,
          accumulateNormal,
          accumulateCovariance,
          squaredResiduals,
          placePoints,
          sumOverCells};
}
