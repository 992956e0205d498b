// Residuals and the sums of one evaluation, for any number type. Included after
// kernel_surface.inl and placeInFrame().

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
  Number S[6];
  placeInFrame(surface, points, i, p.q, p.f);
  loadCovariance(points, i, S);
  p.weight = load(points.channel[9] + i);
  p.noise.enter(surface.s.R, S);
  surface.applyG(p.q, p.g);
  p.g[2] = p.g[2] - 2.0;
  p.noise.apply(p.g, p.t);
  // Padding has Sigma = 0 and weight 0: keep its V away from zero.
  p.V = dot(p.g, p.t) + (1.0 - p.weight);
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

// Sums over the lanes of accumulators, and of structures of nothing else, to structures
// of the same form.
HOLDFAST_INLINE void
reduce(const Number* sums, int n, double* out)
{
  int i = 0;
  for (; i + kLanes <= n; i += kLanes)
    sumsOfLanes(sums + i, out + i);
  for (; i < n; ++i)
    out[i] = sumOfLanes(sums[i]);
}

template <template <typename> class Sums>
HOLDFAST_INLINE void
reduce(const Sums<Number>& sums, Sums<double>& out)
{
  reduce(reinterpret_cast<const Number*>(&sums),
         sizeof(Sums<double>) / sizeof(double),
         reinterpret_cast<double*>(&out));
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
struct NormalTotals {
  template <typename T>
  struct Of {
    T cost, L[kPolynomials], JtJ[p * (p + 1) / 2];
  };
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
            typename NormalTotals<p>::template Of<Number>& sums)
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
addJtJ(const NormalSlot<p>* tile,
       int size,
       typename NormalTotals<p>::template Of<Number>& sums)
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
  typename NormalTotals<p>::template Of<Number> sums;
  setZero(sums);
  NormalSlot<p> tile[kTile];
  for (int first = 0; first < points.padded_size; first += kTile * kLanes) {
    const int size = tileSize(points, first);
    for (int i = 0; i < size; ++i)
      fillSlot<ResidualPolicy>(surface, points, first + i * kLanes, tile[i]);
    addGradient(surface, tile, size, sums);
    addJtJ(tile, size, sums);
  }
  typename NormalTotals<p>::template Of<double> total;
  reduce<NormalTotals<p>::template Of>(sums, total);
  surface.combine(total.L, out.gradient);
  out.cost = total.cost;
  std::copy(std::begin(total.JtJ), std::end(total.JtJ), out.JtJ);
}
