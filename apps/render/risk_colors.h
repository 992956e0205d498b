/// \file The colours of risk.
#pragma once

#include "render/canvas.h"

#include <array>

namespace holdfast::app {

/// Of a total risk: green at a thousandth and below, yellow, red at 1; its logarithm
/// decides.
Rgb riskColor(double total);

/// Place on that scale: 0 at a thousandth, 1 at 1.
double riskFraction(double total);

/// The colour of a place on it.
Rgb riskScaleColor(double place);

/// At 0, 1/2 and 1 of that scale, with mixtures between: green, yellow and red, each of
/// another brightness.
inline constexpr std::array<Rgb, 3> kRiskColors{
    {{26, 130, 60}, {250, 220, 90}, {190, 20, 40}}};

/// The total risk at 0.
inline constexpr double kLeastRisk = 1e-3;

/// Surface that was seen, and too little of it for a sole.
inline constexpr Rgb kNoSupport{150, 150, 150};

} // namespace holdfast::app
