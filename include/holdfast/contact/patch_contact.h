/// \file Patch against patch: whether a curved sole, palm or finger pad fits a surface.
#pragma once

#include <holdfast/contact/contact_risk.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/patch/patch.h>

#include <optional>
#include <string>

namespace holdfast {

/// What a pad and a surface may be off each other, and how far the pad may be turned
/// from how it was planned to make it less.
struct PatchContactOptions {
  double max_gap_m = 0.005; ///< the surface below the pad
  double max_penetration_m = 0.002; ///< the surface above it: what a soft pad gives way
  double max_tilt_rad = 0.3; ///< of the pad's normal from against the load
  double max_turn_rad = kPi; ///< about that, to either side
};

/// Empty when the options make sense, else one sentence.
std::string validityError(const PatchContactOptions& options);

/// How a pad lies on a surface.
struct PatchFitness {
  /// Of the pad, frame of the surface: where its misfit, in shares of what it may be,
  /// is least.
  Pose pose;
  double gap_m = 0.0; ///< largest, as expected
  double penetration_m = 0.0; ///< largest, as expected
  /// Probabilities that somewhere under the pad it is more than it may be, and of
  /// either; with the errors of the surface as contactRisk() has them.
  double gap_risk = 0.0, penetration_risk = 0.0, risk = 0.0;
};

struct PatchContact {
  ContactStatus status = ContactStatus::InsufficientSupport;
  double support_share = 0.0; ///< of the pad, on surface that was seen
  std::optional<PatchFitness> fitness; ///< nothing without enough support
};

/// The robot's own surface as a pad: a patch of it, with its normal out of the robot.
/// Its outline is told to `spacing_m`. A rock-shaped (negative) curvature of the patch
/// is a ball's on the ground.
/// \throw std::invalid_argument when the patch is not valid.
Foot padOf(const Patch& patch, double spacing_m = 0.005);

/// The best pose of a pad near a placement, its middle staying on the line of the load.
/// \param pad of which curvature, sole and min_support count.
/// \throw std::invalid_argument when an argument makes no sense.
PatchContact patchContact(const ContactSurface& surface,
                          const Foot& pad,
                          const Placement& placement,
                          const PatchContactOptions& options = {});

} // namespace holdfast
