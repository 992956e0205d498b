// The kernel for every instruction set the compiler knows, chosen at run time
// (Highway).
#include "kernel.h"

#include <algorithm>
#include <limits>
#include <utility>

#ifdef HOLDFAST_HAVE_HIGHWAY

#undef HWY_DISABLED_TARGETS
// The steps between SSSE3, AVX2 and AVX-512 gain nothing here; scalable vectors cannot
// be members of a class.
#define HWY_DISABLED_TARGETS \
  (HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/kernel_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#define HOLDFAST_INLINE HWY_INLINE
#define HOLDFAST_UNROLL _Pragma("GCC unroll 32")

HWY_BEFORE_NAMESPACE();
namespace holdfast { namespace kernel { namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

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

#include "kernel_point.inl"

const char*
targetName()
{
  return hwy::TargetName(HWY_TARGET);
}

// Exported under names of their own: the shared file overloads its functions.
int
dispatchedLeadingValid(const Points& points)
{
  return leadingValid(points);
}

void
dispatchedScatter(const Points& points, ScatterSums& sums)
{
  scatterSums(points, sums);
}

void
dispatchedQuadric(const Points& points,
                  const double R[9],
                  const double c[3],
                  QuadricSums& sums)
{
  quadricSums(points, R, c, sums);
}

void
dispatchedNormal(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 NormalSums& sums)
{
  normalSums(model, residual, points, state, sums);
}

void
dispatchedCovariance(Model model,
                     Residual residual,
                     const Points& points,
                     const State& state,
                     CovarianceSums& sums)
{
  covarianceSums(model, residual, points, state, sums);
}

void
dispatchedMove(const Points& points,
               const double R[9],
               const double c[3],
               const double h[6],
               const double viewpoint[3],
               double* const out[3])
{
  moveOnto(points, R, c, h, viewpoint, out);
}

void
dispatchedResiduals(Model model,
                    Residual residual,
                    const Points& points,
                    const State& state,
                    double* out)
{
  residualsOfPoints(model, residual, points, state, out);
}

}}} // namespace holdfast::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace holdfast { namespace kernel {

HWY_EXPORT(targetName);
HWY_EXPORT(dispatchedLeadingValid);
HWY_EXPORT(dispatchedScatter);
HWY_EXPORT(dispatchedQuadric);
HWY_EXPORT(dispatchedNormal);
HWY_EXPORT(dispatchedCovariance);
HWY_EXPORT(dispatchedMove);
HWY_EXPORT(dispatchedResiduals);

const char*
instructionSet()
{
  return HWY_DYNAMIC_DISPATCH(targetName)();
}

int
countLeadingValid(const Points& points)
{
  return HWY_DYNAMIC_DISPATCH(dispatchedLeadingValid)(points);
}

void
accumulateScatter(const Points& points, ScatterSums& sums)
{
  HWY_DYNAMIC_DISPATCH(dispatchedScatter)(points, sums);
}

void
accumulateQuadric(const Points& points,
                  const double R[9],
                  const double c[3],
                  QuadricSums& sums)
{
  HWY_DYNAMIC_DISPATCH(dispatchedQuadric)(points, R, c, sums);
}

void
accumulateNormal(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 NormalSums& sums)
{
  HWY_DYNAMIC_DISPATCH(dispatchedNormal)(model, residual, points, state, sums);
}

void
accumulateCovariance(Model model,
                     Residual residual,
                     const Points& points,
                     const State& state,
                     CovarianceSums& sums)
{
  HWY_DYNAMIC_DISPATCH(dispatchedCovariance)(model, residual, points, state, sums);
}

void
moveOntoQuadric(const Points& points,
                const double R[9],
                const double c[3],
                const double h[6],
                const double viewpoint[3],
                double* const out[3])
{
  HWY_DYNAMIC_DISPATCH(dispatchedMove)(points, R, c, h, viewpoint, out);
}

void
squaredResiduals(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 double* out)
{
  HWY_DYNAMIC_DISPATCH(dispatchedResiduals)(model, residual, points, state, out);
}

}} // namespace holdfast::kernel
#endif

#else // the reference code serves where Highway is not there

namespace holdfast { namespace kernel {

const char*
instructionSet()
{
  return "scalar";
}

int
countLeadingValid(const Points& points)
{
  return reference::countLeadingValid(points);
}

void
accumulateScatter(const Points& points, ScatterSums& sums)
{
  reference::accumulateScatter(points, sums);
}

void
accumulateQuadric(const Points& points,
                  const double R[9],
                  const double c[3],
                  QuadricSums& sums)
{
  reference::accumulateQuadric(points, R, c, sums);
}

void
accumulateNormal(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 NormalSums& sums)
{
  reference::accumulateNormal(model, residual, points, state, sums);
}

void
accumulateCovariance(Model model,
                     Residual residual,
                     const Points& points,
                     const State& state,
                     CovarianceSums& sums)
{
  reference::accumulateCovariance(model, residual, points, state, sums);
}

void
moveOntoQuadric(const Points& points,
                const double R[9],
                const double c[3],
                const double h[6],
                const double viewpoint[3],
                double* const out[3])
{
  reference::moveOntoQuadric(points, R, c, h, viewpoint, out);
}

void
squaredResiduals(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 double* out)
{
  reference::squaredResiduals(model, residual, points, state, out);
}

}} // namespace holdfast::kernel

#endif
