/// \file Names of the shapes of a noise pattern.
#pragma once

#include <holdfast/enum_names.h>
#include <holdfast/noise_pattern.h>

namespace holdfast {

inline constexpr EnumNames<PatternShape, 2> kPatternShapeNames{
    {"exponential", "gaussian"}};

} // namespace holdfast
