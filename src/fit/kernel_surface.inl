// Small vectors of numbers, polynomials and surfaces, for any number type. Included
// like kernel_point.inl, after the same definitions.

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

// As it is in the batch.
HOLDFAST_INLINE void
loadCovariance(const Points& points, int i, Number S[6])
{
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

template <Model model>
struct SurfaceOf;
template <>
struct SurfaceOf<Model::Paraboloid> {
  using Type = ParaboloidSurface;
};
template <>
struct SurfaceOf<Model::Sphere> {
  using Type = SphereSurface;
};
template <>
struct SurfaceOf<Model::Cylinder> {
  using Type = CylinderSurface;
};
template <>
struct SurfaceOf<Model::Plane> {
  using Type = PlaneSurface;
};
