/// \file What the scenes of makeScene() are put together from.
#pragma once

#include <holdfast/simulation/scene.h>

#include <cstdint>
#include <memory>
#include <utility>

namespace holdfast {

template <typename ShapeType, typename... Arguments>
void
addShape(Scene& scene, Arguments&&... arguments)
{
  scene.shapes.push_back(
      std::make_shared<ShapeType>(std::forward<Arguments>(arguments)...));
}

Pose turnedAboutZ(double angle, const Eigen::Vector3d& center);

/// A box that stands with its bottom at `foot`.
void addStandingBox(Scene& scene,
                    const Eigen::Vector3d& foot,
                    const Eigen::Vector3d& size,
                    double angle);

/// A flat floor at z = 0, a square.
void addFloor(Scene& scene, double size = 6.0);

/// A half-buried rock.
void addBoulder(Scene& scene,
                const Terrain& ground,
                double x,
                double y,
                const Eigen::Vector3d& radii,
                std::uint64_t seed);

/// Looks down at the target, the middle of the scene, by 40 degrees, slightly from the
/// side.
void placeSensor(Scene& scene, const Eigen::Vector3d& target, double distance);

// Scenes in files of their own.
void makeBoulderField(Scene& scene, double distance);
void makeStairway(Scene& scene, double distance);

} // namespace holdfast
