// Number, kLanes floats of one instruction set, as kernel_number.inl has doubles. What
// is loaded and stored are doubles all the same, but for what the kernel keeps to
// itself.

using Scalar = float;
constexpr hn::ScalableTag<float> kTag;
constexpr hn::Half<hn::ScalableTag<float>> kHalfTag;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kTag));

struct Number {
  hn::Vec<hn::ScalableTag<float>> v;

  Number() = default;
  HWY_INLINE explicit Number(double x) : v(hn::Set(kTag, static_cast<float>(x))) {}
  HWY_INLINE explicit Number(hn::Vec<hn::ScalableTag<float>> x) : v(x) {}
};

// Two times as many lanes as doubles have.
HWY_INLINE Number
joined(wide::Number first, wide::Number second)
{
  return Number(hn::Combine(kTag,
                            hn::DemoteTo(kHalfTag, second.v),
                            hn::DemoteTo(kHalfTag, first.v)));
}

HWY_INLINE Number
load(const double* p)
{
  return joined(wide::load(p), wide::load(p + wide::kLanes));
}

HWY_INLINE void
store(Number x, double* p)
{
  hn::StoreU(hn::PromoteTo(wide::kTag, hn::LowerHalf(kHalfTag, x.v)), wide::kTag, p);
  hn::StoreU(hn::PromoteTo(wide::kTag, hn::UpperHalf(kHalfTag, x.v)),
             wide::kTag,
             p + wide::kLanes);
}

HWY_INLINE Number
load(const float* p)
{
  return Number(hn::Load(kTag, p));
}

HWY_INLINE void
store(Number x, float* p)
{
  hn::StoreU(x.v, kTag, p);
}

HWY_INLINE void
storeByLane(const Number x[4], float* p)
{
  hn::StoreInterleaved4(x[0].v, x[1].v, x[2].v, x[3].v, kTag, p);
}

#include "kernel_operators.inl"
