// The kernel for every instruction set the compiler knows, one table each, chosen at
// run time (Highway).
#include "kernel.h"

#include <algorithm>
#include <limits>
#include <utility>

#ifdef HOLDFAST_HAVE_HIGHWAY

#include "fit/vector_targets.inl"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/kernel_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#define HOLDFAST_INLINE HWY_INLINE
#define HOLDFAST_NOINLINE HWY_NOINLINE
#define HOLDFAST_UNROLLED_FOR(...) _Pragma("GCC unroll 32") for (__VA_ARGS__)
#define HOLDFAST_ROLLED_FOR(...) _Pragma("GCC unroll 1") for (__VA_ARGS__)

HWY_BEFORE_NAMESPACE();
namespace holdfast { namespace kernel { namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#include "kernel_number.inl"
#include "kernel_point.inl"

#if HWY_TARGET == HWY_SCALAR
namespace single = holdfast::kernel::HWY_NAMESPACE; // which gains nothing
#else
namespace single {

namespace wide = holdfast::kernel::HWY_NAMESPACE;

#include "kernel_single.inl"

} // namespace single
#endif

void
accumulateNormalIn(Precision precision,
                   Model model,
                   Residual residual,
                   const Points& points,
                   const State& state,
                   NormalSums& sums)
{
  if (precision == Precision::Single)
    single::accumulateNormal(model, residual, points, state, sums);
  else
    accumulateNormal(model, residual, points, state, sums);
}

void
accumulateCovarianceIn(Precision precision,
                       Model model,
                       Residual residual,
                       const Points& points,
                       const State& state,
                       CovarianceSums& sums)
{
  if (precision == Precision::Double ||
      !single::accumulateByFeet(model, residual, points, state, sums))
    accumulateCovariance(model, residual, points, state, sums);
}

void
sumOverCellsIn(Precision precision, const CellSums& cells, double* out)
{
  if (precision == Precision::Single)
    single::sumOverCells(cells, out);
  else
    sumOverCells(cells, out);
}

#include "kernel_table.inl"

Kernel
kernelOfTarget()
{
  return makeKernel(hwy::TargetName(HWY_TARGET));
}

}}} // namespace holdfast::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace holdfast { namespace kernel {

HWY_EXPORT(kernelOfTarget);

const Kernel&
kernel()
{
  static const Kernel fastest = HWY_DYNAMIC_DISPATCH(kernelOfTarget)();
  return fastest;
}

}} // namespace holdfast::kernel
#endif

#else // the reference code serves where Highway is not there

namespace holdfast { namespace kernel {

const Kernel&
kernel()
{
  return referenceKernel();
}

}} // namespace holdfast::kernel

#endif
