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

// Numbers from `entry` on of a lane whose first is at y, of a row that storeByLane()
// has stored four by four.
template <typename Tag>
HWY_INLINE hn::Vec<Tag>
rowPart(Tag tag, const Scalar* y, int entry)
{
  constexpr int lanes = static_cast<int>(hn::MaxLanes(Tag()));
  if constexpr (lanes <= 4) {
    return hn::Load(tag, y + entry / 4 * 4 * kLanes + entry % 4);
  }
  else {
    const hn::Half<Tag> half;
    return hn::Combine(tag,
                       rowPart(half, y, entry + lanes / 2),
                       rowPart(half, y, entry));
  }
}
#else
HWY_INLINE void
sumsOfLanes(const Number* v, double* out)
{
  store(*v, out);
}

HWY_INLINE hn::Vec<hn::ScalableTag<Scalar>>
rowPart(hn::ScalableTag<Scalar> tag, const Scalar* y, int entry)
{
  return hn::Load(tag, y + entry);
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

// Adds the row of a lane to what is there.
HWY_INLINE void
addRow(const Scalar* y, int lane, Scalar* sum)
{
  for (int k = 0; k < kCellRow; k += kLanes)
    hn::Store(hn::Add(hn::Load(kTag, sum + k), rowPart(kTag, y + 4 * lane, k)),
              kTag,
              sum + k);
}
