/// \file Names of the enumerations of this folder.
#pragma once

#include <holdfast/io/cloud_io.h>
#include <holdfast/patch/names.h>

namespace holdfast {

inline constexpr EnumNames<CloudAxes, 3> kCloudAxesNames{
    {"x-right,y-down,z-forward", "opengl", "ros"}};

} // namespace holdfast
