/// \file The colours of risk.
#pragma once

#include "render/canvas.h"

namespace holdfast::app {

/// Of a total risk: green at a thousandth and below, yellow, red at 1; its logarithm
/// decides.
Rgb riskColor(double total);

/// Place on that scale: 0 at a thousandth, 1 at 1.
double riskFraction(double total);

/// The colour of a place on it.
Rgb riskScaleColor(double place);

/// Surface that was seen, and too little of it for a sole.
inline constexpr Rgb kNoSupport{150, 150, 150};

} // namespace holdfast::app
