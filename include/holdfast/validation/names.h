/// \file Names of the outcomes of the checks.
#pragma once

#include <holdfast/patch/names.h>
#include <holdfast/validation/checks.h>

namespace holdfast {

inline constexpr EnumNames<PatchVerdict, 12> kVerdictNames{{"accepted",
                                                            "not_usable",
                                                            "curvature_too_large",
                                                            "residual_too_large",
                                                            "coverage_too_low",
                                                            "chi_square_too_large",
                                                            "extent_too_large",
                                                            "sagitta_too_large",
                                                            "departure_too_large",
                                                            "normal_not_seen",
                                                            "over_edge",
                                                            "noise_too_large"}};

} // namespace holdfast
