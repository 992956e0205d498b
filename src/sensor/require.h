/// \file Checks of numeric parameters.
#pragma once

#include <holdfast/sensor/parameter_error.h>

#include <cmath>
#include <string>

namespace holdfast {

/// \throw ParameterError unless value is finite and >= 0.
inline void
requireNotNegative(const std::string& name, double value)
{
  if (!std::isfinite(value) || value < 0.0)
    throw ParameterError(name, "must be a finite number >= 0");
}

/// \throw ParameterError unless value is finite and > 0.
inline void
requirePositive(const std::string& name, double value)
{
  if (!std::isfinite(value) || value <= 0.0)
    throw ParameterError(name, "must be a finite number > 0");
}

} // namespace holdfast
