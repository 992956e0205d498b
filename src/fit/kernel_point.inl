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
//   HOLDFAST_INLINE           before functions of the hot loop
//   HOLDFAST_UNROLL           before loops of constant length, whose arrays then live
//   in
//                             registers
//
// The notation is that of holdfast/fit/kernel.h.

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

HOLDFAST_INLINE void
cross(const Number a[3], const Number b[3], Number out[3])
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

// R^T v.
HOLDFAST_INLINE void
rotateIntoFrame(const double R[9], const Number v[3], Number out[3])
{
  HOLDFAST_UNROLL
  for (int i = 0; i < 3; ++i)
    out[i] = v[0] * R[i] + v[1] * R[3 + i] + v[2] * R[6 + i];
}

// R^T S R.
HOLDFAST_INLINE void
rotateCovarianceIntoFrame(const double R[9], const Number S[6], Number out[6])
{
  Number SR[3][3]; // row i: (S R)(:, i)
  HOLDFAST_UNROLL
  for (int i = 0; i < 3; ++i) {
    SR[i][0] = S[0] * R[i] + S[1] * R[3 + i] + S[2] * R[6 + i];
    SR[i][1] = S[1] * R[i] + S[3] * R[3 + i] + S[4] * R[6 + i];
    SR[i][2] = S[2] * R[i] + S[4] * R[3 + i] + S[5] * R[6 + i];
  }
  const int row[6] = {0, 0, 0, 1, 1, 2};
  const int column[6] = {0, 1, 2, 1, 2, 2};
  HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e)
    out[e] = SR[column[e]][0] * R[row[e]] + SR[column[e]][1] * R[3 + row[e]] +
             SR[column[e]][2] * R[6 + row[e]];
}

// e x u - G (e x v): with u = G v it is G_a v, with v = q and u = g it is B_a.
template <int axis, typename Surface>
HOLDFAST_INLINE void
rotationDerivativeG(const Surface& surface,
                    const Number v[3],
                    const Number u[3],
                    Number out[3])
{
  constexpr int i = (axis + 1) % 3, j = (axis + 2) % 3;
  Number turned[3], G_turned[3];
  turned[axis] = Number(0.0);
  turned[i] = 0.0 - v[j];
  turned[j] = v[i];
  surface.applyG(turned, G_turned);
  out[axis] = 0.0 - G_turned[axis];
  out[i] = 0.0 - u[j] - G_turned[i];
  out[j] = u[i] - G_turned[j];
}

// Component `axis` of a rotation R <- R Exp(delta) as a parameter of the surface:
// f_a = (g x q)_axis and B_a = e x g - G (e x q).
template <int axis, typename Surface>
HOLDFAST_INLINE void
rotationDerivative(const Surface& surface,
                   const Number q[3],
                   const Number g[3],
                   Number& f,
                   Number B[3])
{
  constexpr int i = (axis + 1) % 3, j = (axis + 2) % 3;
  f = g[i] * q[j] - g[j] * q[i];
  rotationDerivativeG<axis>(surface, q, g, B);
}

// ---- Surfaces: G v, and per shape parameter f_a, B_a and G_a v --------------------

struct ParaboloidSurface {
  static constexpr int kShape = shapeParameterCount(Model::Paraboloid);
  static constexpr int kTranslations = 1;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number v[3], Number out[3]) const
  {
    out[0] = v[0] * (2.0 * s.k[0]) + v[1] * (2.0 * s.k[1]);
    out[1] = v[0] * (2.0 * s.k[1]) + v[1] * (2.0 * s.k[2]);
    out[2] = Number(0.0);
  }

  // dG/dkxx, dG/dkxy, dG/dkyy times v.
  static HOLDFAST_INLINE void applyCurvatureDerivative(const Number v[3],
                                                       Number out[3][3])
  {
    const Number x = v[0] * 2.0, y = v[1] * 2.0, zero(0.0);
    out[0][0] = x, out[0][1] = zero, out[0][2] = zero;
    out[1][0] = y, out[1][1] = x, out[1][2] = zero;
    out[2][0] = zero, out[2][1] = y, out[2][2] = zero;
  }

  HOLDFAST_INLINE void shape(const Number q[3],
                             const Number g[3],
                             Number f[kShape],
                             Number B[kShape][3]) const
  {
    f[0] = q[0] * q[0];
    f[1] = q[0] * q[1] * 2.0;
    f[2] = q[1] * q[1];
    applyCurvatureDerivative(q, B);
    rotationDerivative<0>(*this, q, g, f[3], B[3]);
    rotationDerivative<1>(*this, q, g, f[4], B[4]);
  }

  // G_a v for every shape parameter; Gv = G v.
  HOLDFAST_INLINE void applyShapeG(const Number v[3],
                                   const Number Gv[3],
                                   Number out[kShape][3]) const
  {
    applyCurvatureDerivative(v, out);
    rotationDerivativeG<0>(*this, v, Gv, out[3]);
    rotationDerivativeG<1>(*this, v, Gv, out[4]);
  }

  HOLDFAST_INLINE void direction(int, double d[3]) const
  {
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i)
      d[i] = s.line[i];
  }
};

struct SphereSurface {
  static constexpr int kShape = shapeParameterCount(Model::Sphere);
  static constexpr int kTranslations = 3;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number v[3], Number out[3]) const
  {
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i)
      out[i] = v[i] * (2.0 * s.k[0]);
  }

  HOLDFAST_INLINE void shape(const Number q[3],
                             const Number*,
                             Number f[kShape],
                             Number B[kShape][3]) const
  {
    f[0] = dot(q, q);
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i)
      B[0][i] = q[i] * 2.0;
  }

  HOLDFAST_INLINE void applyShapeG(const Number v[3],
                                   const Number*,
                                   Number out[kShape][3]) const
  {
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i)
      out[0][i] = v[i] * 2.0;
  }

  HOLDFAST_INLINE void direction(int i, double d[3]) const
  {
    d[0] = d[1] = d[2] = 0.0;
    d[i] = 1.0;
  }
};

struct CylinderSurface {
  static constexpr int kShape = shapeParameterCount(Model::Cylinder);
  static constexpr int kTranslations = 2;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number v[3], Number out[3]) const
  {
    out[0] = Number(0.0);
    out[1] = v[1] * (2.0 * s.k[0]);
    out[2] = v[2] * (2.0 * s.k[0]);
  }

  HOLDFAST_INLINE void shape(const Number q[3],
                             const Number g[3],
                             Number f[kShape],
                             Number B[kShape][3]) const
  {
    f[0] = q[1] * q[1] + q[2] * q[2];
    B[0][0] = Number(0.0), B[0][1] = q[1] * 2.0, B[0][2] = q[2] * 2.0;
    rotationDerivative<1>(*this, q, g, f[1], B[1]);
    rotationDerivative<2>(*this, q, g, f[2], B[2]);
  }

  HOLDFAST_INLINE void applyShapeG(const Number v[3],
                                   const Number Gv[3],
                                   Number out[kShape][3]) const
  {
    out[0][0] = Number(0.0), out[0][1] = v[1] * 2.0, out[0][2] = v[2] * 2.0;
    rotationDerivativeG<1>(*this, v, Gv, out[1]);
    rotationDerivativeG<2>(*this, v, Gv, out[2]);
  }

  HOLDFAST_INLINE void direction(int i, double d[3]) const
  {
    d[0] = d[1] = d[2] = 0.0;
    d[i + 1] = 1.0;
  }
};

struct PlaneSurface {
  static constexpr int kShape = shapeParameterCount(Model::Plane);
  static constexpr int kTranslations = 1;
  const State& s;

  HOLDFAST_INLINE void applyG(const Number*, Number out[3]) const
  {
    out[0] = out[1] = out[2] = Number(0.0);
  }

  HOLDFAST_INLINE void shape(const Number q[3],
                             const Number g[3],
                             Number f[kShape],
                             Number B[kShape][3]) const
  {
    rotationDerivative<0>(*this, q, g, f[0], B[0]);
    rotationDerivative<1>(*this, q, g, f[1], B[1]);
  }

  HOLDFAST_INLINE void applyShapeG(const Number*,
                                   const Number*,
                                   Number out[kShape][3]) const
  {
    HOLDFAST_UNROLL
    for (int a = 0; a < kShape; ++a)
      out[a][0] = out[a][1] = out[a][2] = Number(0.0);
  }

  HOLDFAST_INLINE void direction(int, double d[3]) const
  {
    d[0] = d[1] = 0.0;
    d[2] = 1.0;
  }
};

// ---- Residuals: E(f, V, w) and its partial derivatives ----------------------------

struct Partials {
  Number E, f, V, w; // E and its gradient
  Number ff, fV, VV, fw, Vw, ww; // its Hessian
};

// Gradient of e, where E = e^2 / 2.
struct ResidualGradient {
  Number f, V, w;
};

// E = f^2 / (2 V).
struct SampsonResidual {
  static constexpr bool kUsesCurvature = false;

  static HOLDFAST_INLINE void evaluate(Number f,
                                       Number V,
                                       Number,
                                       Partials& p,
                                       ResidualGradient& e)
  {
    const Number inverse = 1.0 / V;
    const Number h = f * inverse;
    const Number root = squareRoot(inverse);
    p.E = f * h * 0.5;
    p.f = h;
    p.V = h * h * -0.5;
    p.w = Number(0.0);
    e.f = root;
    e.V = h * root * -0.5;
    e.w = Number(0.0);
  }

  static HOLDFAST_INLINE void second(Number f, Number V, Number, Partials& p)
  {
    const Number inverse = 1.0 / V;
    const Number h = f * inverse;
    p.ff = inverse;
    p.fV = 0.0 - h * inverse;
    p.VV = h * h * inverse;
    p.fw = p.Vw = p.ww = Number(0.0);
  }
};

// E = phi(tau)^2 f^2 / (2 V), tau = 4 f w / V^2, phi = 2 / (1 + s), s = sqrt(1 - tau):
// half the squared Mahalanobis distance to the foot on the ray q - t Sigma g. Where the
// ray all but misses the surface, 1 - tau < 1/4, s continues as (1/4)/(3/4 - (1 -
// tau)), which meets the root in value and slope and stays positive.
struct RayResidual {
  static constexpr bool kUsesCurvature = true;

  // s and its first two derivatives with respect to tau.
  static HOLDFAST_INLINE void root(Number tau, Number& s, Number& s1, Number& s2)
  {
    const Number x = 1.0 - tau;
    const Number quarter(0.25);
    const Number hit = squareRoot(selectLess(x, quarter, quarter, x));
    const Number inverse = 1.0 / selectLess(x, quarter, 0.75 - x, hit);
    s = selectLess(x, quarter, inverse * 0.25, hit);
    // Hit: s' = -1/(2s), s'' = -1/(4 s^3). Miss, y = 1/(3/4 - x): -y^2/4, y^3/2.
    s1 = selectLess(x, quarter, inverse * inverse * -0.25, inverse * -0.5);
    s2 = inverse * inverse * inverse *
         selectLess(x, quarter, Number(0.5), Number(-0.25));
  }

  static HOLDFAST_INLINE void evaluate(Number f,
                                       Number V,
                                       Number w,
                                       Partials& p,
                                       ResidualGradient& e)
  {
    const Number inverse = 1.0 / V;
    const Number h = f * inverse;
    const Number tau = h * w * inverse * 4.0;
    Number s, s1, s2;
    root(tau, s, s1, s2);
    const Number phi = 2.0 / (1.0 + s);
    const Number phi1 = phi * phi * s1 * -0.5;
    const Number Phi = phi * phi, Phi1 = phi * phi1 * 2.0;
    p.E = f * h * Phi * 0.5;
    p.f = h * (Phi + tau * Phi1 * 0.5);
    p.V = h * h * (Phi + tau * Phi1 * 2.0) * -0.5;
    p.w = h * h * h * Phi1 * 2.0;
    const Number inverse_root = squareRoot(inverse);
    e.f = inverse_root * (phi + tau * phi1);
    e.V = inverse_root * h * (phi * -0.5 - tau * phi1 * 2.0);
    e.w = inverse_root * h * h * phi1 * 4.0;
  }

  static HOLDFAST_INLINE void second(Number f, Number V, Number w, Partials& p)
  {
    const Number inverse = 1.0 / V;
    const Number h = f * inverse;
    const Number tau = h * w * inverse * 4.0;
    Number s, s1, s2;
    root(tau, s, s1, s2);
    const Number phi = 2.0 / (1.0 + s);
    const Number phi1 = phi * phi * s1 * -0.5;
    const Number phi2 = phi * phi * (phi * s1 * s1 - s2) * 0.5;
    const Number Phi = phi * phi, Phi1 = phi * phi1 * 2.0;
    const Number tau_Phi2 = tau * (phi1 * phi1 + phi * phi2) * 2.0;
    const Number h2 = h * h * inverse;
    p.ff = inverse * (Phi + tau * (Phi1 * 2.0 + tau_Phi2 * 0.5));
    p.fV = 0.0 - h * inverse * (Phi + tau * (Phi1 * 3.5 + tau_Phi2));
    p.VV = h2 * (Phi + tau * (Phi1 * 5.0 + tau_Phi2 * 2.0));
    p.fw = h2 * (Phi1 * 3.0 + tau_Phi2) * 2.0;
    p.Vw = h2 * h * (Phi1 * 3.0 + tau_Phi2 * 2.0) * -2.0;
    p.ww = h2 * h * h * (phi1 * phi1 + phi * phi2) * 16.0;
  }
};

// ---- One point --------------------------------------------------------------------

// A point seen from the local frame.
struct Local {
  Number q[3], S[6], weight;
  Number g[3], t[3], Gt[3], r[3];
  Number f, V, w;
};

template <typename Surface, typename ResidualPolicy>
HOLDFAST_INLINE void
enterFrame(const Surface& surface, const Points& points, int i, Local& p)
{
  const State& state = surface.s;
  Number offset[3], S[6];
  HOLDFAST_UNROLL
  for (int k = 0; k < 3; ++k)
    offset[k] = load(points.channel[k] + i) - state.c[k];
  HOLDFAST_UNROLL
  for (int k = 0; k < 6; ++k)
    S[k] = load(points.channel[3 + k] + i);
  p.weight = load(points.channel[9] + i);
  rotateIntoFrame(state.R, offset, p.q);
  rotateCovarianceIntoFrame(state.R, S, p.S);
  surface.applyG(p.q, p.g);
  p.g[2] = p.g[2] - 2.0;
  multiply(p.S, p.g, p.t);
  // Padding has Sigma = 0 and weight 0: keep its V away from zero.
  p.V = dot(p.g, p.t) + (1.0 - p.weight);
  p.f = dot(p.q, p.g) * 0.5 - p.q[2];
  surface.applyG(p.t, p.Gt);
  if (ResidualPolicy::kUsesCurvature) {
    multiply(p.S, p.Gt, p.r);
    p.w = dot(p.t, p.Gt) * 0.5;
  }
  else {
    p.r[0] = p.r[1] = p.r[2] = p.w = Number(0.0);
  }
}

HOLDFAST_INLINE void
applyWeight(Number weight, Partials& E)
{
  E.E = E.E * weight;
  E.f = E.f * weight;
  E.V = E.V * weight;
  E.w = E.w * weight;
}

HOLDFAST_INLINE void
applyWeightToSecond(Number weight, Partials& E)
{
  E.ff = E.ff * weight;
  E.fV = E.fV * weight;
  E.VV = E.VV * weight;
  E.fw = E.fw * weight;
  E.Vw = E.Vw * weight;
  E.ww = E.ww * weight;
}

// Adds one point's share of L[p] for the ten polynomials.
HOLDFAST_INLINE void
addPolynomials(const Local& p, const Partials& E, Number L[kPolynomials])
{
  const Number x = p.q[0], y = p.q[1], z = p.q[2];
  Number m[3];
  HOLDFAST_UNROLL
  for (int i = 0; i < 3; ++i)
    m[i] = p.t[i] * E.V * 2.0 + p.r[i] * E.w;
  const Number fx = E.f * x, fy = E.f * y, fz = E.f * z;
  const Number wx = E.w * p.t[0], wy = E.w * p.t[1], wz = E.w * p.t[2];
  L[P1] = L[P1] + E.f;
  L[PX] = L[PX] + (fx + m[0]);
  L[PY] = L[PY] + (fy + m[1]);
  L[PZ] = L[PZ] + (fz + m[2]);
  L[PXX] = L[PXX] + (x * (fx + m[0] * 2.0) + wx * p.t[0]);
  L[PYY] = L[PYY] + (y * (fy + m[1] * 2.0) + wy * p.t[1]);
  L[PZZ] = L[PZZ] + (z * (fz + m[2] * 2.0) + wz * p.t[2]);
  L[PXY] = L[PXY] + (x * (fy + m[1]) + y * m[0] + wx * p.t[1]);
  L[PXZ] = L[PXZ] + (x * (fz + m[2]) + z * m[0] + wx * p.t[2]);
  L[PYZ] = L[PYZ] + (y * (fz + m[2]) + z * m[1] + wy * p.t[2]);
}

// f_a, B_a, and G_a t, G_a r of every parameter at one point.
template <typename Surface>
struct ParameterDerivatives {
  static constexpr int kShape = Surface::kShape;
  static constexpr int kCount = kShape + Surface::kTranslations;
  Number f[kCount], B[kCount][3];
  Number Gt[kShape][3], Gr[kShape][3]; // zero for translations
};

template <typename Surface, typename ResidualPolicy>
HOLDFAST_INLINE void
differentiate(const Surface& surface, const Local& p, ParameterDerivatives<Surface>& d)
{
  surface.shape(p.q, p.g, d.f, d.B);
  surface.applyShapeG(p.t, p.Gt, d.Gt);
  if (ResidualPolicy::kUsesCurvature) {
    Number Gr[3];
    surface.applyG(p.r, Gr);
    surface.applyShapeG(p.r, Gr, d.Gr);
  }
  HOLDFAST_UNROLL
  for (int i = 0; i < Surface::kTranslations; ++i) {
    double u[3];
    surface.direction(i, u);
    const Number direction[3] = {Number(u[0]), Number(u[1]), Number(u[2])};
    const int a = Surface::kShape + i;
    Number Gu[3];
    surface.applyG(direction, Gu);
    d.f[a] = 0.0 - dot(p.g, direction);
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k)
      d.B[a][k] = 0.0 - Gu[k];
  }
}

// w_a = B_a.r + t^T G_a t / 2.
template <typename Surface>
HOLDFAST_INLINE Number
curvatureDerivative(const Local& p, const ParameterDerivatives<Surface>& d, int a)
{
  const Number linear = dot(d.B[a], p.r);
  return a < Surface::kShape ?
             linear + dot(p.t, d.Gt[a < Surface::kShape ? a : 0]) * 0.5 :
             linear;
}

// X_a = d^2E / dtheta_a dq by the chain rule through f, V, w; also u_a = Sigma B_a and
// h_a = G u_a + G_a t, which the Hessian needs again.
template <typename Surface, typename ResidualPolicy>
HOLDFAST_INLINE void
crossTerm(const Surface& surface,
          const Local& p,
          const ParameterDerivatives<Surface>& d,
          const Partials& E,
          int a,
          Number slope[3],
          Number u[3],
          Number h[3],
          Number X[3])
{
  const bool shape = a < Surface::kShape;
  const int b = shape ? a : 0;
  multiply(p.S, d.B[a], u);
  surface.applyG(u, h);
  HOLDFAST_UNROLL
  for (int i = 0; i < 3 && shape; ++i)
    h[i] = h[i] + d.Gt[b][i];
  const Number f_a = d.f[a], V_a = dot(d.B[a], p.t) * 2.0;
  slope[0] = E.ff * f_a + E.fV * V_a;
  slope[1] = E.fV * f_a + E.VV * V_a;
  if (ResidualPolicy::kUsesCurvature) {
    const Number w_a = curvatureDerivative(p, d, a);
    slope[0] = slope[0] + E.fw * w_a;
    slope[1] = slope[1] + E.Vw * w_a;
    slope[2] = E.fw * f_a + E.Vw * V_a + E.ww * w_a;
  }
  HOLDFAST_UNROLL
  for (int i = 0; i < 3; ++i)
    X[i] =
        slope[0] * p.g[i] + (slope[1] * p.Gt[i] + E.V * h[i]) * 2.0 + E.f * d.B[a][i];
  if (ResidualPolicy::kUsesCurvature) {
    Number Gr[3], Sh[3], GSh[3];
    surface.applyG(p.r, Gr);
    multiply(p.S, h, Sh);
    surface.applyG(Sh, GSh);
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i) {
      X[i] = X[i] + slope[2] * Gr[i] + E.w * GSh[i];
      if (shape)
        X[i] = X[i] + E.w * d.Gr[b][i];
    }
  }
}

// ---- The sums ---------------------------------------------------------------------

template <typename Surface, typename ResidualPolicy>
void
normalSums(const Points& points, const State& state, NormalSums& out)
{
  constexpr int p = ParameterDerivatives<Surface>::kCount;
  constexpr int kTriangle = p * (p + 1) / 2;
  const Surface surface{state};
  Number cost(0.0), L[kPolynomials], JtJ[kTriangle];
  for (Number& sum : L)
    sum = Number(0.0);
  for (Number& sum : JtJ)
    sum = Number(0.0);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Local local;
    enterFrame<Surface, ResidualPolicy>(surface, points, i, local);
    Partials E;
    ResidualGradient e;
    ResidualPolicy::evaluate(local.f, local.V, local.w, E, e);
    applyWeight(local.weight, E);
    cost = cost + E.E;
    addPolynomials(local, E, L);

    ParameterDerivatives<Surface> d;
    differentiate<Surface, ResidualPolicy>(surface, local, d);
    Number J[p];
    HOLDFAST_UNROLL
    for (int a = 0; a < p; ++a) {
      J[a] = e.f * d.f[a] + e.V * dot(d.B[a], local.t) * 2.0;
      if (ResidualPolicy::kUsesCurvature)
        J[a] = J[a] + e.w * curvatureDerivative(local, d, a);
      J[a] = J[a] * local.weight;
    }
    HOLDFAST_UNROLL
    for (int a = 0, entry = 0; a < p; ++a)
      HOLDFAST_UNROLL
    for (int b = a; b < p; ++b, ++entry)
      JtJ[entry] = JtJ[entry] + J[a] * J[b];
  }
  out.cost = sumOfLanes(cost);
  HOLDFAST_UNROLL
  for (int i = 0; i < kPolynomials; ++i)
    out.L[i] = sumOfLanes(L[i]);
  HOLDFAST_UNROLL
  for (int i = 0; i < kTriangle; ++i)
    out.JtJ[i] = sumOfLanes(JtJ[i]);
}

template <int p, int shape>
struct CovarianceAccumulators {
  Number cost, L[kPolynomials], H[shape * (shape + 1) / 2];
  Number X[p][3], XX[p * (p + 1) / 2], XS[p][3], XSq[p][6];
  Number S[6], qS[3][6], qqS[6][6];
};

// Sums that do not depend on the surface: how the points' noise moves their moments.
template <int p, int shape>
HOLDFAST_INLINE void
addMoments(const Local& local,
           const Number qt[3],
           CovarianceAccumulators<p, shape>& sums)
{
  Number qS[3][6];
  HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e) {
    sums.S[e] = sums.S[e] + local.S[e];
    HOLDFAST_UNROLL
    for (int a = 0; a < 3; ++a) {
      qS[a][e] = qt[a] * local.S[e];
      sums.qS[a][e] = sums.qS[a][e] + qS[a][e];
    }
  }
  HOLDFAST_UNROLL
  for (int a = 0, pair = 0; a < 3; ++a)
    HOLDFAST_UNROLL
  for (int b = a; b < 3; ++b, ++pair)
    HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e)
    sums.qqS[pair][e] = sums.qqS[pair][e] + qt[b] * qS[a][e];
}

template <typename Surface, typename ResidualPolicy, int p, int shape>
HOLDFAST_INLINE void
addSecondDerivatives(const Surface& surface,
                     const Local& local,
                     const Partials& E,
                     const Number qt[3],
                     CovarianceAccumulators<p, shape>& sums)
{
  ParameterDerivatives<Surface> d;
  differentiate<Surface, ResidualPolicy>(surface, local, d);
  Number slope[p][3], u[p][3], h[p][3], X[p][3], XS[p][3];
  HOLDFAST_UNROLL
  for (int a = 0; a < p; ++a) {
    crossTerm<Surface,
              ResidualPolicy>(surface, local, d, E, a, slope[a], u[a], h[a], X[a]);
    multiply(local.S, X[a], XS[a]);
  }
  HOLDFAST_UNROLL
  for (int a = 0, entry = 0; a < shape; ++a)
    HOLDFAST_UNROLL
  for (int b = a; b < shape; ++b, ++entry) {
    Number H = slope[a][0] * d.f[b] +
               (slope[a][1] * dot(d.B[b], local.t) + E.V * dot(u[a], d.B[b])) * 2.0;
    if (ResidualPolicy::kUsesCurvature)
      H = H + slope[a][2] * curvatureDerivative(local, d, b) +
          E.w * (dot(u[a], h[b]) + dot(u[b], d.Gt[a]));
    sums.H[entry] = sums.H[entry] + H;
  }
  HOLDFAST_UNROLL
  for (int a = 0, entry = 0; a < p; ++a) {
    HOLDFAST_UNROLL
    for (int b = a; b < p; ++b, ++entry)
      sums.XX[entry] = sums.XX[entry] + dot(X[a], XS[b]);
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i) {
      sums.X[a][i] = sums.X[a][i] + X[a][i];
      sums.XS[a][i] = sums.XS[a][i] + XS[a][i];
    }
    HOLDFAST_UNROLL
    for (int i = 0, pair = 0; i < 3; ++i)
      HOLDFAST_UNROLL
    for (int j = i; j < 3; ++j, ++pair)
      sums.XSq[a][pair] = sums.XSq[a][pair] + (XS[a][i] * qt[j] + XS[a][j] * qt[i]);
  }
}

template <int p, int shape>
void
reduce(const CovarianceAccumulators<p, shape>& sums, CovarianceSums& out)
{
  out.cost = sumOfLanes(sums.cost);
  HOLDFAST_UNROLL
  for (int i = 0; i < kPolynomials; ++i)
    out.L[i] = sumOfLanes(sums.L[i]);
  HOLDFAST_UNROLL
  for (int i = 0; i < shape * (shape + 1) / 2; ++i)
    out.H[i] = sumOfLanes(sums.H[i]);
  HOLDFAST_UNROLL
  for (int i = 0; i < p * (p + 1) / 2; ++i)
    out.XX[i] = sumOfLanes(sums.XX[i]);
  HOLDFAST_UNROLL
  for (int a = 0; a < p; ++a) {
    HOLDFAST_UNROLL
    for (int i = 0; i < 3; ++i) {
      out.X[a][i] = sumOfLanes(sums.X[a][i]);
      out.XS[a][i] = sumOfLanes(sums.XS[a][i]);
    }
    HOLDFAST_UNROLL
    for (int i = 0; i < 6; ++i)
      out.XSq[a][i] = sumOfLanes(sums.XSq[a][i]);
  }
  HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e) {
    out.S[e] = sumOfLanes(sums.S[e]);
    HOLDFAST_UNROLL
    for (int a = 0; a < 3; ++a)
      out.qS[a][e] = sumOfLanes(sums.qS[a][e]);
    HOLDFAST_UNROLL
    for (int pair = 0; pair < 6; ++pair)
      out.qqS[pair][e] = sumOfLanes(sums.qqS[pair][e]);
  }
}

template <typename Sums>
HOLDFAST_INLINE void
setZero(Sums& sums)
{
  Number* entry = reinterpret_cast<Number*>(&sums);
  for (unsigned i = 0; i < sizeof(Sums) / sizeof(Number); ++i)
    entry[i] = Number(0.0);
}

template <typename Surface, typename ResidualPolicy>
void
covarianceSums(const Points& points, const State& state, CovarianceSums& out)
{
  constexpr int p = ParameterDerivatives<Surface>::kCount;
  const Surface surface{state};
  CovarianceAccumulators<p, Surface::kShape> sums;
  setZero(sums);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Local local;
    enterFrame<Surface, ResidualPolicy>(surface, points, i, local);
    Partials E;
    ResidualGradient e;
    ResidualPolicy::evaluate(local.f, local.V, local.w, E, e);
    ResidualPolicy::second(local.f, local.V, local.w, E);
    applyWeight(local.weight, E);
    applyWeightToSecond(local.weight, E);
    sums.cost = sums.cost + E.E;
    addPolynomials(local, E, sums.L);
    Number qt[3];
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k)
      qt[k] = local.q[k] - state.centroid[k];
    addMoments(local, qt, sums);
    addSecondDerivatives<Surface, ResidualPolicy>(surface, local, E, qt, sums);
  }
  reduce(sums, out);
}

// X_i of every point, padding included: p x 3 x kLanes values per step.
template <typename Surface, typename ResidualPolicy>
void
crossTermsOfPoints(const Points& points, const State& state, double* out)
{
  constexpr int p = ParameterDerivatives<Surface>::kCount;
  const Surface surface{state};
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Local local;
    enterFrame<Surface, ResidualPolicy>(surface, points, i, local);
    Partials E;
    ResidualGradient e;
    ResidualPolicy::evaluate(local.f, local.V, local.w, E, e);
    ResidualPolicy::second(local.f, local.V, local.w, E);
    applyWeight(local.weight, E);
    applyWeightToSecond(local.weight, E);
    ParameterDerivatives<Surface> d;
    differentiate<Surface, ResidualPolicy>(surface, local, d);
    HOLDFAST_UNROLL
    for (int a = 0; a < p; ++a, out += 3) {
      Number slope[3], u[3], h[3], X[3];
      crossTerm<Surface, ResidualPolicy>(surface, local, d, E, a, slope, u, h, X);
      HOLDFAST_UNROLL
      for (int k = 0; k < 3; ++k)
        out[k] = sumOfLanes(X[k]);
    }
  }
}

inline void
scatterSums(const Points& points, ScatterSums& out)
{
  Number q[3], qq[6], sigma[6];
  for (Number& sum : q)
    sum = Number(0.0);
  HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e)
    qq[e] = sigma[e] = Number(0.0);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    const Number weight = load(points.channel[9] + i);
    Number v[3];
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k) {
      v[k] = load(points.channel[k] + i) * weight;
      q[k] = q[k] + v[k];
    }
    HOLDFAST_UNROLL
    for (int a = 0, pair = 0; a < 3; ++a)
      HOLDFAST_UNROLL
    for (int b = a; b < 3; ++b, ++pair)
      qq[pair] = qq[pair] + v[a] * v[b];
    HOLDFAST_UNROLL
    for (int e = 0; e < 6; ++e)
      sigma[e] = sigma[e] + load(points.channel[3 + e] + i);
  }
  HOLDFAST_UNROLL
  for (int k = 0; k < 3; ++k)
    out.q[k] = sumOfLanes(q[k]);
  HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e) {
    out.qq[e] = sumOfLanes(qq[e]);
    out.sigma[e] = sumOfLanes(sigma[e]);
  }
}

inline void
quadricSums(const Points& points,
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
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k)
      offset[k] = load(points.channel[k] + i) - c[k];
    const Number weight = load(points.channel[9] + i);
    rotateIntoFrame(R, offset, q);
    Number term[15];
    term[0] = weight;
    HOLDFAST_UNROLL
    for (int degree = 1, at = 1; degree <= 4; ++degree) {
      const int previous = at - degree;
      HOLDFAST_UNROLL
      for (int k = 0; k < degree; ++k)
        term[at + k] = term[previous + k] * q[0];
      term[at + degree] = term[at - 1] * q[1];
      at += degree + 1;
    }
    HOLDFAST_UNROLL
    for (int e = 0; e < 15; ++e)
      monomial[e] = monomial[e] + term[e];
    HOLDFAST_UNROLL
    for (int e = 0; e < 6; ++e)
      height[e] = height[e] + term[e] * q[2];
  }
  HOLDFAST_UNROLL
  for (int e = 0; e < 15; ++e)
    out.monomial[e] = sumOfLanes(monomial[e]);
  HOLDFAST_UNROLL
  for (int e = 0; e < 6; ++e)
    out.z[e] = sumOfLanes(height[e]);
}

inline void
moveOnto(const Points& points,
         const double R[9],
         const double c[3],
         const double h[6],
         const double viewpoint[3],
         double* const out[3])
{
  Number origin[3], camera[3];
  HOLDFAST_UNROLL
  for (int k = 0; k < 3; ++k)
    origin[k] = Number(viewpoint[k] - c[k]);
  rotateIntoFrame(R, origin, camera);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    Number offset[3], q[3], ray[3];
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k)
      offset[k] = load(points.channel[k] + i) - c[k];
    rotateIntoFrame(R, offset, q);
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k)
      ray[k] = q[k] - camera[k];
    Number move(0.0); // t - 1
    HOLDFAST_UNROLL
    for (int step = 0; step < 2; ++step) {
      const Number x = q[0] + move * ray[0], y = q[1] + move * ray[1];
      const Number hx = x * h[3] + y * h[4], hy = x * h[4] + y * h[5];
      const Number height = x * (hx * 0.5 + h[1]) + y * (hy * 0.5 + h[2]) + h[0];
      const Number slope = ray[2] - ray[0] * (hx + h[1]) - ray[1] * (hy + h[2]);
      move = move - (q[2] + move * ray[2] - height) / slope;
    }
    const Number limit(0.1);
    move = selectLess(move, limit, move, Number(0.0));
    move = selectLess(0.0 - limit, move, move, Number(0.0));
    HOLDFAST_UNROLL
    for (int k = 0; k < 3; ++k)
      store(load(points.channel[k] + i) * (move + 1.0) - move * viewpoint[k],
            out[k] + i);
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

inline void
normalSums(Model model,
           Residual residual,
           const Points& points,
           const State& state,
           NormalSums& sums)
{
  forSurfaceAndResidual(model, residual, NormalAction{points, state, sums});
}

inline void
covarianceSums(Model model,
               Residual residual,
               const Points& points,
               const State& state,
               CovarianceSums& sums)
{
  forSurfaceAndResidual(model, residual, CovarianceAction{points, state, sums});
}
