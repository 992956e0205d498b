/// \file What was true of a simulated cloud.
#pragma once

#include "arguments.h"

#include <holdfast/simulation/scene.h>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace holdfast::app {

/// What a cloud is of; lengths in the truth are metres, angles radians.
struct SimulatedView {
  const Scene& scene;
  const Sensor& sensor;
  const RayGrid& rays;
};

/// The truth of one cloud, whose sensor stands at the scene's sensor pose.
nlohmann::ordered_json truthJson(const SimulateArguments& arguments,
                                 const SimulatedView& view);

/// The truth of the clouds of a moving camera, whose poses are in trajectory.txt.
nlohmann::ordered_json movingTruthJson(const SimulateArguments& arguments,
                                       const SimulatedView& view,
                                       const std::vector<std::string>& clouds);

void saveJson(const std::string& path, const nlohmann::ordered_json& json);

} // namespace holdfast::app
