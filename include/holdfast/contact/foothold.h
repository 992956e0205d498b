/// \file The best places for a foot on a map.
#pragma once

#include <holdfast/contact/contact_risk.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace holdfast {

struct FootholdOptions {
  /// As Placement::load_direction, frame of the map.
  Eigen::Vector3d load_direction = -Eigen::Vector3d::UnitZ();
  int yaws = 16; ///< directions of the sole that are tried, over a full turn
  /// Footholds that are returned are no nearer to each other, m; 0: all of them.
  double spacing_m = 0.1;
  int max_footholds = std::numeric_limits<int>::max();
  int threads = 1; ///< 0: one per core
};

/// Empty when the options make sense, else one sentence.
std::string validityError(const FootholdOptions& options);

/// The middle of where a surface was seen, on the surface that is expected there, in
/// its frame; nothing where it was seen nowhere.
std::optional<Eigen::Vector3d> middleOfSupport(const ContactSurface& surface);

struct Foothold {
  std::uint64_t patch = 0; ///< id in the map
  Placement placement;
  ContactRisk risk;
  int views = 0; ///< independent ones of the patch
  int last_seen = 0; ///< number of the map's update
};

/// Every candidate is in one of the last five numbers, or a foothold.
struct FootholdRanking {
  /// Every patch at its best yaw, in the order of the map, also without quality.
  std::vector<Foothold> tried;
  /// All with their quality, best first: by total risk in steps of 1e-6, then by
  /// contact area.
  std::vector<Foothold> footholds;
  int candidates = 0; ///< patches of the map
  int unseen = 0; ///< patches whose support is empty: a map without support grids
  int without_support = 0; ///< the sole reaches beyond what was seen, whatever its yaw
  int not_facing = 0; ///< NotFacingTheLoad
  int too_near = 0; ///< left out for a better one within spacing_m
  int beyond_limit = 0; ///< left out for max_footholds better ones
  /// How far the widest patch was seen from its middle, m: a sole that reaches further
  /// (soleReach()) wants a map of a larger radius.
  double widest_support_m = 0.0;
};

/// Tries every patch of a map at the middle of what was seen of it, in the direction
/// that is best there. The result does not depend on the number of threads.
/// \throw std::invalid_argument when foot or options make no sense.
FootholdRanking rankFootholds(const PatchMap& map,
                              const Foot& foot,
                              const FootholdOptions& options = {});

/// The same at all yaws, the best of them: by total risk, then by contact area. What
/// rankFootholds() does at one place.
/// \param placement its yaw becomes the best one.
/// \throw std::invalid_argument as contactRisks().
ContactRisk bestYaw(const ContactSurface& surface,
                    const Foot& foot,
                    Placement& placement,
                    int yaws);

} // namespace holdfast
