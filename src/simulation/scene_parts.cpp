#include "scene_parts.h"

#include <holdfast/simulation/simulator.h>

#include <Eigen/Geometry>

#include <cmath>

namespace holdfast {

using Eigen::Vector3d;

Pose
turnedAboutZ(double angle, const Vector3d& center)
{
  return {Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(), center};
}

void
addStandingBox(Scene& scene, const Vector3d& foot, const Vector3d& size, double angle)
{
  addShape<Box>(scene,
                turnedAboutZ(angle, foot + Vector3d(0, 0, 0.5 * size.z())),
                size);
}

void
addFloor(Scene& scene, double size)
{
  addShape<Box>(scene, turnedAboutZ(0.0, {0, 0, -0.05}), Vector3d(size, size, 0.1));
}

void
addBoulder(Scene& scene,
           const Terrain& ground,
           double x,
           double y,
           const Vector3d& radii,
           std::uint64_t seed)
{
  const Vector3d center(x, y, ground.heightAt(x, y) + 0.3 * radii.z());
  // Any angle will do; the golden one never repeats.
  const double angle = 2.4 * static_cast<double>(seed);
  addShape<Boulder>(scene, turnedAboutZ(angle, center), radii, 0.2, seed);
}

void
placeSensor(Scene& scene, const Vector3d& target, double distance)
{
  constexpr double kElevation = 0.7;
  constexpr double kAzimuth = -2.6;
  const Vector3d direction(std::cos(kElevation) * std::cos(kAzimuth),
                           std::cos(kElevation) * std::sin(kAzimuth),
                           std::sin(kElevation));
  scene.sensor_pose = lookAt(target + distance * direction, target, Vector3d::UnitZ());
  scene.middle = target;
}

} // namespace holdfast
