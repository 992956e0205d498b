#include <holdfast/patch/surface.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/simulation/scene.h>

#include "scene_parts.h"
#include "sensor/require.h"

#include <algorithm>
#include <stdexcept>

namespace holdfast {

namespace {

using Eigen::Vector3d;

constexpr double kDefaultPatchDistance = 1.0;
constexpr double kDefaultSceneDistance = 1.2;

void
makeRocks(Scene& scene, double distance)
{
  const auto ground =
      std::make_shared<Terrain>(Vector3d::Zero(), 6.0, 0.04, 0.7, std::uint64_t{1});
  scene.shapes.push_back(ground);
  addBoulder(scene, *ground, 0.05, 0.00, {0.22, 0.17, 0.14}, 2);
  addBoulder(scene, *ground, -0.28, 0.20, {0.13, 0.10, 0.09}, 3);
  addBoulder(scene, *ground, -0.22, -0.25, {0.16, 0.12, 0.08}, 4);
  addBoulder(scene, *ground, 0.35, -0.22, {0.18, 0.14, 0.15}, 5);
  addBoulder(scene, *ground, 0.38, 0.30, {0.24, 0.20, 0.20}, 6);
  addBoulder(scene, *ground, 0.00, 0.48, {0.20, 0.15, 0.16}, 7);
  addBoulder(scene, *ground, 0.05, -0.52, {0.14, 0.12, 0.10}, 8);
  addBoulder(scene, *ground, 0.80, 0.05, {0.30, 0.24, 0.25}, 9);
  addBoulder(scene, *ground, -0.45, -0.05, {0.09, 0.08, 0.06}, 10);
  placeSensor(scene, {0, 0, 0.05}, distance);
}

void
makeStairs(Scene& scene, double distance)
{
  constexpr double kRise = 0.15;
  constexpr double kRun = 0.28;
  addFloor(scene);
  for (int step = 0; step < 5; ++step)
    addStandingBox(scene,
                   {-0.3 + (step + 0.5) * kRun, 0.0, 0.0},
                   {kRun, 1.2, (step + 1) * kRise},
                   0.0);
  placeSensor(scene, {0.0, 0.0, 0.25}, distance);
}

void
makePipe(Scene& scene, double distance)
{
  constexpr double kRadius = 0.06;
  addFloor(scene);
  addShape<Pipe>(scene, Vector3d(0, 0, kRadius), Vector3d(0.4, 1.0, 0.0), kRadius, 0.8);
  placeSensor(scene, {0, 0, kRadius}, distance);
}

void
makeBall(Scene& scene, double distance)
{
  constexpr double kRadius = 0.12;
  addFloor(scene);
  addShape<Ball>(scene, Vector3d(0, 0, kRadius), kRadius);
  placeSensor(scene, {0, 0, kRadius}, distance);
}

void
makeTable(Scene& scene, double distance)
{
  constexpr double kHeight = 0.72;
  constexpr double kTop = 0.03;
  const Vector3d size(0.7, 1.1, kTop);
  addFloor(scene);
  addStandingBox(scene, {0, 0, kHeight - kTop}, size, 0.0);
  for (const double x : {-0.32, 0.32})
    for (const double y : {-0.52, 0.52})
      addStandingBox(scene, {x, y, 0}, {0.05, 0.05, kHeight - kTop}, 0.0);
  addStandingBox(scene, {0.15, -0.20, kHeight}, {0.07, 0.16, 0.22}, 0.5);
  addShape<Pipe>(scene,
                 Vector3d(0.0, 0.08, kHeight + 0.06),
                 Vector3d::UnitZ(),
                 0.04,
                 0.12);
  addShape<Ball>(scene, Vector3d(-0.15, -0.10, kHeight + 0.05), 0.05);
  placeSensor(scene, {0, 0, kHeight}, distance);
}

void
makeMix(Scene& scene, double distance)
{
  const auto ground =
      std::make_shared<Terrain>(Vector3d::Zero(), 6.0, 0.02, 0.8, std::uint64_t{11});
  scene.shapes.push_back(ground);
  const auto onGround = [&](double x, double y, double above) {
    return Vector3d(x, y, ground->heightAt(x, y) + above);
  };
  addStandingBox(scene, onGround(0.45, 0.05, -0.1), {0.35, 0.8, 0.25}, 0.1);
  addBoulder(scene, *ground, -0.05, 0.22, {0.17, 0.14, 0.12}, 12);
  addBoulder(scene, *ground, -0.35, -0.05, {0.11, 0.09, 0.08}, 13);
  addShape<Ball>(scene, onGround(-0.05, -0.12, 0.09), 0.09);
  addShape<Pipe>(scene,
                 onGround(0.05, -0.42, 0.05),
                 Vector3d(1.0, 0.3, 0.0),
                 0.05,
                 0.6);
  placeSensor(scene, {0, 0, 0.08}, distance);
}

struct NamedScene {
  std::string name;
  void (*make)(Scene&, double distance);
};

const std::vector<NamedScene>&
namedScenes()
{
  static const std::vector<NamedScene> scenes{{"rocks", makeRocks},
                                              {"stairs", makeStairs},
                                              {"pipe", makePipe},
                                              {"ball", makeBall},
                                              {"table", makeTable},
                                              {"mix", makeMix},
                                              {"boulder_field", makeBoulderField},
                                              {"stairway", makeStairway}};
  return scenes;
}

/// The surface implies the boundary but for planes.
std::string
patchSceneName(PatchType type)
{
  std::string name(surfaceName(type.surface));
  if (type.surface == SurfaceType::Plane)
    name += "_" + std::string(boundaryName(type.boundary));
  return name;
}

} // namespace

std::optional<Hit>
firstHit(const Scene& scene, const Vector3d& origin, const Vector3d& direction)
{
  std::optional<Hit> first;
  int index = 0;
  const auto consider = [&](const std::optional<double>& t) {
    if (t && (!first || *t < first->t))
      first = Hit{*t, index};
    ++index;
  };
  for (const Patch& patch : scene.patches)
    consider(intersectRay(patch, origin, direction));
  for (const auto& shape : scene.shapes) {
    const bool is_hidden =
        first && shape->nearestPossible(origin, direction) >= first->t;
    consider(is_hidden ? std::nullopt : shape->intersect(origin, direction));
  }
  return first;
}

std::vector<std::string>
sceneNames()
{
  std::vector<std::string> names;
  for (const PatchType& type : kPatchTypes)
    names.push_back(patchSceneName(type));
  for (const NamedScene& scene : namedScenes())
    names.push_back(scene.name);
  return names;
}

Scene
makeScene(const std::string& name, std::optional<double> distance)
{
  if (distance)
    requirePositive("distance", *distance);
  Scene scene;
  scene.name = name;
  std::replace(scene.name.begin(), scene.name.end(), '-', '_');
  for (const PatchType& type : kPatchTypes) {
    if (scene.name != patchSceneName(type))
      continue;
    const double d = distance.value_or(kDefaultPatchDistance);
    const Scene robot = robotScene(type, d, 0.5, 0.6).scene;
    scene.patches = robot.patches;
    scene.sensor_pose = robot.sensor_pose;
    scene.middle = robot.patches.front().c;
    return scene;
  }
  for (const NamedScene& candidate : namedScenes()) {
    if (scene.name != candidate.name)
      continue;
    candidate.make(scene, distance.value_or(kDefaultSceneDistance));
    return scene;
  }
  throw std::invalid_argument("there is no scene " + name);
}

} // namespace holdfast
