// Arithmetic of a Number of vectors, double or float, after its load() and store().

#define HOLDFAST_OPERATOR(op, function)             \
  HWY_INLINE Number operator op(Number a, Number b) \
  {                                                 \
    return Number(hn::function(a.v, b.v));          \
  }                                                 \
  HWY_INLINE Number operator op(Number a, double b) \
  {                                                 \
    return a op Number(b);                          \
  }                                                 \
  HWY_INLINE Number operator op(double a, Number b) \
  {                                                 \
    return Number(a) op b;                          \
  }
HOLDFAST_OPERATOR(+, Add)
HOLDFAST_OPERATOR(-, Sub)
HOLDFAST_OPERATOR(*, Mul)
HOLDFAST_OPERATOR(/, Div)
#undef HOLDFAST_OPERATOR

HWY_INLINE double
sumOfLanes(Number x)
{
  return hn::GetLane(hn::SumOfLanes(kTag, x.v));
}

#if HWY_TARGET != HWY_SCALAR
// Lanes of the first, two by two, then of the second.
HWY_INLINE Number
pairSums(Number a, Number b)
{
  return Number(hn::Add(hn::ConcatEven(kTag, b.v, a.v), hn::ConcatOdd(kTag, b.v, a.v)));
}

HWY_INLINE void
sumsOfLanes(const Number* v, double* out)
{
  Number level[kLanes];
  for (int i = 0; i < kLanes; ++i)
    level[i] = v[i];
  for (int n = kLanes / 2; n > 0; n /= 2)
    for (int i = 0; i < n; ++i)
      level[i] = pairSums(level[2 * i], level[2 * i + 1]);
  store(level[0], out);
}
#else
HWY_INLINE void
sumsOfLanes(const Number* v, double* out)
{
  store(*v, out);
}
#endif

HWY_INLINE Number
squareRoot(Number x)
{
  return Number(hn::Sqrt(x.v));
}

HWY_INLINE Number
selectLess(Number a, Number b, Number x, Number y)
{
  return Number(hn::IfThenElse(hn::Lt(a.v, b.v), x.v, y.v));
}

HWY_INLINE bool
allLess(Number a, Number b)
{
  return hn::AllTrue(kTag, hn::Lt(a.v, b.v));
}
