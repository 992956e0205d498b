// Number, kLanes doubles of one instruction set, with what kernel_point.inl and
// kernel_valid.inl are written in. No include guard: included once for every
// instruction set, inside that set's namespace, after Highway and `hn`.

constexpr hn::ScalableTag<double> kTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kTag));

// kLanes doubles with the arithmetic the shared mathematics is written in.
struct Number {
  hn::Vec<hn::ScalableTag<double>> v;

  Number() = default;
  HWY_INLINE explicit Number(double x) : v(hn::Set(kTag, x)) {}
  HWY_INLINE explicit Number(hn::Vec<hn::ScalableTag<double>> x) : v(x) {}
};

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

HWY_INLINE Number
load(const double* p)
{
  return Number(hn::Load(kTag, p));
}

HWY_INLINE void
store(Number x, double* p)
{
  hn::StoreU(x.v, kTag, p);
}

HWY_INLINE double
sumOfLanes(Number x)
{
  return hn::GetLane(hn::SumOfLanes(kTag, x.v));
}

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
