/// \file What contact risk is judged by: draws of the surface, and the true surface.
#pragma once

#include <holdfast/contact/contact_risk.h>
#include <holdfast/simulation/scene.h>

#include <optional>
#include <random>

namespace holdfast {

/// How often each event happens in draws of a surface, by brute force and by nothing
/// that contactRisk() works with but the jet at the load; `total` is the sum, `joint`
/// how often any happens, and `support` is not looked at. The sole is taken to lie on
/// the surface in its own frame (yaw and all).
/// \return nothing where the surface does not face the load.
/// \throw std::invalid_argument as contactRisk() does.
std::optional<ContactEvents> drawnContactEvents(const ContactSurface& surface,
                                                const Foot& foot,
                                                const Placement& placement,
                                                int draws,
                                                std::mt19937_64& generator);

/// A coefficient of friction from its distribution.
double drawFriction(const Friction& friction, std::mt19937_64& generator);

/// What a foot meets on the true surface.
struct TrueContact {
  double height_m = 0.0; ///< of the surface at the planned point, against the load
  Eigen::Vector2d slope = Eigen::Vector2d::Zero(); ///< there, axes of the load's frame
  /// Largest distance of the surface from the plane that lies best under the sole.
  double gap_m = 0.0;
};

/// A compliant ankle's foot on a scene.
/// \param load loadFrame() in the world of the scene.
/// \param reach_m surfaces are looked for so far above and below the planned point.
/// \return nothing where a part of the sole has no surface under it.
std::optional<TrueContact> trueContact(const Scene& scene,
                                       const Foot& foot,
                                       const Pose& load,
                                       double reach_m = 0.2);

} // namespace holdfast
