/// \file Simulated scenes.
#pragma once

#include <holdfast/patch/patch.h>
#include <holdfast/simulation/shape.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// Bounded patches and other shapes, and where the sensor stands. World frame.
struct Scene {
  std::string name;
  std::vector<Patch> patches;
  std::vector<std::shared_ptr<const Shape>> shapes;
  Pose sensor_pose; ///< q_world = R q_camera + c
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(); ///< what makeScene() looks at
  /// On the ground, where a walk through the scene begins, along +x.
  Eigen::Vector3d walk_start = {-2.0, 0.0, 0.0};
};

/// What a ray meets first.
struct Hit {
  double t = 0.0; ///< at origin + t direction
  int index = 0; ///< in Scene::patches, or behind them in Scene::shapes
};

/// The hit with the smallest t >= 0 of origin + t direction.
std::optional<Hit> firstHit(const Scene& scene,
                            const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction);

/// Names of all scenes: one for each patch type, "elliptic_paraboloid" to
/// "circular_cylinder", planes as "plane_ellipse" etc., then "rocks", "stairs", "pipe",
/// "ball", "table" and "mix", and two to walk 10 m through: "boulder_field", 170 rocks
/// on 12 x 3 m of uneven ground, and "stairway", ten steps up, a landing and ten down.
std::vector<std::string> sceneNames();

/// A scene seen from `distance` metres; by default 1 m for patches, as robotScene() at
/// tilt 0.5, azimuth 0.6 rad, and 1.2 m for the others, whose z axis points up.
/// \param name as in sceneNames(), also with '-' for '_'.
/// \throw std::invalid_argument when there is no such scene or the distance is not
/// positive.
Scene makeScene(const std::string& name, std::optional<double> distance = {});

} // namespace holdfast
