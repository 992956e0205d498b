/// \file Names of the ways to compute a covariance.
#pragma once

#include <holdfast/patch/names.h>
#include <holdfast/uncertainty/covariance_mode.h>

namespace holdfast {

inline constexpr EnumNames<CovarianceMode, 6> kCovarianceModeNames{
    {"exact", "gauss_newton", "second_order", "stagewise", "monte_carlo", "auto"}};

} // namespace holdfast
