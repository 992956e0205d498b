/// \file Names of the outcomes of the checks.
#pragma once

#include <holdfast/patch/names.h>
#include <holdfast/validation/checks.h>

namespace holdfast {

inline constexpr EnumNames<PatchVerdict, 6> kVerdictNames{{"accepted",
                                                           "not_usable",
                                                           "curvature_too_large",
                                                           "residual_too_large",
                                                           "coverage_too_low",
                                                           "chi_square_too_large"}};

} // namespace holdfast
