/// \file Which of several contacts is the better one, and the best yaw at a place.
#pragma once

#include "contact/sole.h"
#include <holdfast/contact/contact_risk.h>

#include <vector>

namespace holdfast::contact {

/// By total risk as far as it is worked out, then by area; nothing is worse than any.
bool isBetter(const ContactRisk& one, const ContactRisk& other);

/// \param soles one in several directions (inAllDirections()).
/// \param placement its yaw becomes the best one's, the first of equals; without enough
///        support in any direction, that of most.
ContactRisk atBestYaw(const ContactSurface& surface,
                      const std::vector<Sole>& soles,
                      Placement& placement);

} // namespace holdfast::contact
