/// \file Feet on maps of simulated walks: what was predicted, and what was there.
#pragma once

#include <holdfast/contact/contact_risk.h>
#include <holdfast/fusion/patch_map.h>
#include <holdfast/progress.h>
#include <holdfast/sensor/sensor.h>

#include <cstdint>
#include <string>
#include <vector>

namespace holdfast::app {

/// Probability of slip, height, tilt or gap alone: ContactEvents::joint also counts
/// what of the sole's place was not seen, which is nothing that happens to the foot.
double probabilityOfAny(const ContactEvents& events);

/// What a foot was told to expect where, and what happened.
struct RiskCase {
  ContactEvents predicted;
  bool slipped = false, was_off_height = false, gaped = false;
  std::uint64_t walk = 0; ///< its seed: places of one share errors of pose and pattern

  bool failed() const
  {
    return slipped || was_off_height || gaped;
  }
};

/// The best of several places for one foot.
struct ChosenCase {
  RiskCase chosen;
  /// What a view that had no part in the choice says of the same place.
  double judged_again = 0.0;
};

struct RiskWalk {
  std::string scene = "boulder_field";
  double radius_m = 0.08; ///< of the map
  double max_depth_change = PatchMapOptions().max_depth_change; ///< of the map
  int frames = 40;
  double step_m = 0.1;
  int stride = 2; ///< of pixels
  bool pattern = false; ///< errors that pixels share, the same in every frame
  Sensor sensor; ///< with its pattern
  int choose_from = 20; ///< places for one foot
  std::uint64_t seed = 1;
  int threads = 0;
  Progress progress;
};

struct RiskOutcome {
  std::vector<RiskCase> single, fused; ///< of one view, of all so far
  std::vector<ChosenCase> chosen; ///< from single views
};

/// Walks through a scene and puts random feet with random tolerances on random places
/// of what was seen last, the load along gravity. The same for any number of threads.
RiskOutcome riskWalk(const RiskWalk& walk);

} // namespace holdfast::app
