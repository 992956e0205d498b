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
#define HOLDFAST_UNROLLED_FOR(...) _Pragma("GCC unroll 32") for (__VA_ARGS__)

HWY_BEFORE_NAMESPACE();
namespace holdfast { namespace kernel { namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#include "kernel_number.inl"
#include "kernel_point.inl"

const char*
targetName()
{
  return hwy::TargetName(HWY_TARGET);
}

// Exported under names of their own: the shared file overloads its functions.
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
