// Number, kLanes doubles of one instruction set, with what kernel_point.inl and
// kernel_valid.inl are written in. No include guard: included once for every
// instruction set, inside that set's namespace, after Highway and `hn`.

using Scalar = double;
constexpr hn::ScalableTag<double> kTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kTag));

// kLanes doubles with the arithmetic the shared mathematics is written in.
struct Number {
  hn::Vec<hn::ScalableTag<double>> v;

  Number() = default;
  HWY_INLINE explicit Number(double x) : v(hn::Set(kTag, x)) {}
  HWY_INLINE explicit Number(hn::Vec<hn::ScalableTag<double>> x) : v(x) {}
};

HWY_INLINE Number
load(const double* p)
{
  return Number(hn::Load(kTag, p));
}

HWY_INLINE Number
loadAnywhere(const double* p)
{
  return Number(hn::LoadU(kTag, p));
}

HWY_INLINE void
store(Number x, double* p)
{
  hn::StoreU(x.v, kTag, p);
}

// Four numbers of each lane, one lane after the other.
HWY_INLINE void
storeByLane(const Number x[4], double* p)
{
  hn::StoreInterleaved4(x[0].v, x[1].v, x[2].v, x[3].v, kTag, p);
}

HWY_INLINE Number
roundedDown(Number x)
{
  return Number(hn::Floor(x.v));
}

#include "kernel_operators.inl"
