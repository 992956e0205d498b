// Points that share errors (fit/pattern.h), for any number type. Included by
// kernel_point.inl.

inline void
accumulatePixels(const Points& points, const double about[2], PixelSums& out)
{
  const double* const* pixel = points.pattern->pixel;
  Number low[2], high[2], sum[2], squares[3];
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 2; ++k) {
    low[k] = high[k] = Number(pixel[k][0]);
    sum[k] = Number(0.0);
  }
  HOLDFAST_UNROLLED_FOR (int e = 0; e < 3; ++e)
    squares[e] = Number(0.0);
  for (int i = 0; i < points.padded_size; i += kLanes) {
    const Number weight = load(points.channel[9] + i);
    Number from[2];
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 2; ++k) {
      const Number at = load(pixel[k] + i);
      low[k] = smaller(low[k], at);
      high[k] = larger(high[k], at);
      from[k] = (at - about[k]) * weight;
      sum[k] = sum[k] + from[k];
    }
    squares[0] = squares[0] + from[0] * from[0];
    squares[1] = squares[1] + from[0] * from[1];
    squares[2] = squares[2] + from[1] * from[1];
  }
  for (int k = 0; k < 2; ++k) {
    alignas(64) double lanes[kLanes];
    store(low[k], lanes);
    out.low[k] = *std::min_element(lanes, lanes + kLanes);
    store(high[k], lanes);
    out.high[k] = *std::max_element(lanes, lanes + kLanes);
    out.sum[k] = sumOfLanes(sum[k]);
  }
  for (int e = 0; e < 3; ++e)
    out.squares[e] = sumOfLanes(squares[e]);
}

// A point has a half of its neighbours at the edge, and as much less than all in the
// mean as a half-plane lacks.
inline void
neighborVariances(const Points& points, const NeighborVariance& neighbors, double* out)
{
  const double* const* pixel = points.pattern->pixel;
  const double *m = neighbors.middle, *T = neighbors.to_disc;
  const Number zero(0.0);
  const double per_radius = neighbors.edge > 0.0 ? 1.0 / neighbors.edge : 0.0;
  const double half = neighbors.edge > 0.0 ? 0.5 : 0.0;
  for (int i = 0; i < points.padded_size; i += kLanes) {
    const Number u = load(pixel[0] + i) - m[0], v = load(pixel[1] + i) - m[1];
    const Number x = u * T[0], y = u * T[1] + v * T[2];
    const Number inside = larger(zero, 1.0 - squareRoot(x * x + y * y));
    const Number lack = larger(zero, 1.0 - inside * per_radius);
    store((1.0 - lack * lack * half) * neighbors.whole - neighbors.less, out + i);
  }
}
