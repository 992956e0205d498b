// The check of the points for every instruction set, chosen at run time (Highway). A
// file of its own: see kernel_valid.inl.
#include "kernel.h"

#include <limits>

#ifdef HOLDFAST_HAVE_HIGHWAY

#include "fit/vector_targets.inl"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/kernel_valid_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace holdfast { namespace kernel { namespace HWY_NAMESPACE {

// A namespace of its own, so that no function compiled with other flags can be taken
// for one of these.
namespace valid {

namespace hn = hwy::HWY_NAMESPACE;

#include "kernel_number.inl"
#include "kernel_valid.inl"

} // namespace valid

int
dispatchedLeadingValid(const Points& points)
{
  return valid::leadingValid(points);
}

}}} // namespace holdfast::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace holdfast { namespace kernel {

HWY_EXPORT(dispatchedLeadingValid);

int
countLeadingValid(const Points& points)
{
  return HWY_DYNAMIC_DISPATCH(dispatchedLeadingValid)(points);
}

}} // namespace holdfast::kernel
#endif

#else // the reference code serves where Highway is not there

namespace holdfast { namespace kernel {

int
countLeadingValid(const Points& points)
{
  return reference::countLeadingValid(points);
}

}} // namespace holdfast::kernel

#endif
