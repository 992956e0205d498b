/// \file Names of surfaces and boundaries.
#pragma once

#include <holdfast/enum_names.h>
#include <holdfast/patch/types.h>

namespace holdfast {

inline constexpr EnumNames<SurfaceType, 7> kSurfaceNames{{"plane",
                                                          "sphere",
                                                          "circular_cylinder",
                                                          "elliptic_paraboloid",
                                                          "hyperbolic_paraboloid",
                                                          "cylindric_paraboloid",
                                                          "circular_paraboloid"}};

inline constexpr EnumNames<BoundaryType, 4> kBoundaryNames{
    {"ellipse", "circle", "rectangle", "quad"}};

} // namespace holdfast
