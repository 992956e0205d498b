// For any number type; see kernel_foot.inl.

// What a point brings along; the weight, 0 or 1, is in s and inverse_D.
struct Foot {
  Number q[3], t[3], r[3], S[6];
  Number s, inverse_D, psi, kappa, omega;
  Number p[3], u[3], m1[3], m2[3], s_q[3];

  // From q, t, r, s, inverse_D and omega.
  template <typename Surface>
  HOLDFAST_INLINE void complete(const Surface& surface, Number V_over_D)
  {
    psi = s * V_over_D;
    kappa = s * psi;
    const Number of_t = s * s - kappa;
    Number reach[3];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
      p[k] = q[k] - s * t[k];
      u[k] = t[k] - s * r[k];
      m1[k] = of_t * t[k] - kappa * u[k];
      m2[k] = (s * t[k] - psi * u[k]) * 2.0;
      reach[k] = (p[k] - s * u[k]) * inverse_D;
    }
    surface.applyG(reach, s_q);
    s_q[2] = s_q[2] - inverse_D * 2.0;
  }
};
