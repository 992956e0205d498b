#include "target.h"

#include "fit/kernel.h"

#ifdef HOLDFAST_HAVE_HIGHWAY
#include <hwy/highway.h>
#endif

#include <cstdint>
#include <cstdlib>
#include <stdexcept>

namespace holdfast::benchmarks {
namespace {

void
disableAllBut(const std::string& name)
{
#ifdef HOLDFAST_HAVE_HIGHWAY
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    const std::int64_t target = left & -left;
    if (hwy::TargetName(target) == name)
      return hwy::DisableTargets(~target);
  }
#endif
  throw std::runtime_error("HOLDFAST_TARGET: there is no " + name + " here");
}

} // namespace

std::string
chooseTarget()
{
  const char* asked = std::getenv("HOLDFAST_TARGET");
  if (asked != nullptr)
    disableAllBut(asked);
  std::string used = kernel::kernel().instruction_set;
  if (asked != nullptr && used != asked)
    throw std::runtime_error("HOLDFAST_TARGET: " + std::string(asked) +
                             " is not to be had, but " + used);
  return used;
}

} // namespace holdfast::benchmarks
