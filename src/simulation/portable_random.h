/// \file Random numbers that are the same on every platform, unlike those of the
/// standard distributions.
#pragma once

#include <random>

namespace holdfast {

/// Uniform in [0, 1).
inline double
uniform(std::mt19937_64& generator)
{
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

inline double
uniform(std::mt19937_64& generator, double low, double high)
{
  return low + (high - low) * uniform(generator);
}

} // namespace holdfast
