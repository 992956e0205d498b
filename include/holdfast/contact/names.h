/// \file Names of the contact layer's enumerations.
#pragma once

#include <holdfast/contact/contact_risk.h>
#include <holdfast/enum_names.h>

namespace holdfast {

inline constexpr EnumNames<Ankle, 2> kAnkleNames{{"compliant", "stiff"}};

inline constexpr EnumNames<ContactStatus, 3> kContactStatusNames{
    {"ok", "insufficient_support", "not_facing_the_load"}};

} // namespace holdfast
