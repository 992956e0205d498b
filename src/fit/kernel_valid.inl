// The one part of the kernel whose input need not be finite: it finds out. Apart from
// kernel_point.inl, as it must not be compiled under -ffinite-math-only, which lets a
// compiler take every comparison with NaN for what it would be without. Included like
// that file, after the same definitions.

// How many points from the first on, in steps of kLanes, are surely valid: coordinates,
// and what they share errors by, finite and the covariance positive definite, by
// leading minors. NaN fails every comparison, and what overflows is not below the
// limit.
inline int
leadingValid(const Points& points)
{
  const Number zero(0.0), limit(std::numeric_limits<double>::max());
  int i = 0;
  for (; i < points.padded_size; i += kLanes) {
    Number q[3], S[6];
    for (int k = 0; k < 3; ++k)
      q[k] = load(points.channel[k] + i);
    for (int k = 0; k < 6; ++k)
      S[k] = load(points.channel[3 + k] + i);
    Number sum = q[0] + q[1] + q[2];
    if (points.pattern != nullptr) {
      for (const double* pixel : points.pattern->pixel)
        sum = sum + load(pixel + i);
      for (const double* direction : points.pattern->direction)
        sum = sum + load(direction + i);
    }
    const Number minor = S[0] * S[3] - S[1] * S[1];
    const Number determinant = S[5] * minor + S[1] * S[2] * S[4] * 2.0 -
                               (S[0] * S[4] * S[4] + S[3] * S[2] * S[2]);
    // Padding has no covariance.
    const Number padding = 1.0 - load(points.channel[9] + i);
    if (!(allLess(zero, S[0] + padding) && allLess(zero, minor + padding) &&
          allLess(zero, determinant + padding) && allLess(determinant, limit) &&
          allLess(sum, limit) && allLess(0.0 - limit, sum)))
      break;
  }
  return i;
}
