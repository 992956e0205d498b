/// \file The instruction set that is measured.
#pragma once

#include <string>

namespace holdfast::benchmarks {

/// Makes the library use the instruction set that HOLDFAST_TARGET names, e.g. AVX2; by
/// default it is the best of the processor. To be called before anything is fitted.
/// \return the name of the one that is used.
/// \throw std::runtime_error for one that the library or the processor does not have.
std::string chooseTarget();

} // namespace holdfast::benchmarks
