/// \file Which of several contacts is the better one, and the best yaw at a place.
#pragma once

#include "contact/sole.h"
#include <holdfast/contact/contact_risk.h>

namespace holdfast::contact {

/// By total risk as far as it is worked out, then by area; nothing is worse than any.
bool isBetter(const ContactRisk& one, const ContactRisk& other);

/// \param placement its yaw becomes the best of so many over a full turn, the first of
///        equals.
ContactRisk atBestYaw(const ContactSurface& surface,
                      const Sole& sole,
                      Placement& placement,
                      int yaws);

} // namespace holdfast::contact
