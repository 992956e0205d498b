#include "fusion_registration.h"

#include <holdfast/evaluation/spot_view.h>
#include <holdfast/fusion/registration.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch_estimator.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace holdfast::app {
namespace {

constexpr double kRadius = 0.04;
constexpr int kStride = 4;
constexpr double kDistance = 1.3;

Scene
sceneOf(RegistrationGround ground, std::mt19937_64& generator)
{
  if (ground == RegistrationGround::Rocks)
    return makeScene("rocks");
  Scene scene;
  scene.shapes.push_back(
      std::make_shared<Terrain>(Eigen::Vector3d::Zero(), 4.0, 0.03, 0.8, generator()));
  return scene;
}

/// Where a vertical line meets the ground, its plane along the surface there.
std::optional<Pose>
discOn(const Scene& scene, double x, double y)
{
  const auto hit = firstHit(scene, {x, y, 2.0}, -Eigen::Vector3d::UnitZ());
  if (!hit)
    return std::nullopt;
  Pose level;
  level.c = {x, y, 2.0 - hit->t};
  const auto best = bestQuadric(scene, level, kRadius);
  // More than the noise of a mean over a few points: an edge, which validation of
  // extracted patches turns down.
  constexpr double kEdge = 1e-3;
  if (!best || best->residual_m > kEdge)
    return std::nullopt;
  const Eigen::Vector3d normal(-best->jet[1], -best->jet[2], 1.0);
  return Pose{frameFromZ(normal.normalized()), level.c};
}

/// Discs on a grid of 25 x 20 over 1.2 x 0.9 m, each moved a little.
std::vector<Pose>
discsOn(const Scene& scene, std::mt19937_64& generator)
{
  constexpr int kColumns = 25, kRows = 20;
  constexpr double kWidth = 1.2, kDepth = 0.9, kMove = 0.005;
  std::vector<Pose> discs;
  for (int i = 0; i < kColumns; ++i)
    for (int j = 0; j < kRows; ++j) {
      const double x = kWidth * ((i + 0.5) / kColumns - 0.5) +
                       uniformBetween(-kMove, kMove, generator);
      const double y =
          kDepth * ((j + 0.5) / kRows - 0.5) + uniformBetween(-kMove, kMove, generator);
      if (const auto disc = discOn(scene, x, y))
        discs.push_back(*disc);
    }
  return discs;
}

Pose
viewFromAbove(std::mt19937_64& generator)
{
  constexpr double kBeside = 0.1;
  const double x = uniformBetween(-kBeside, kBeside, generator);
  const double y = uniformBetween(-kBeside, kBeside, generator);
  return lookAt({x, y, kDistance}, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY());
}

class Registration {
public:
  Registration(const Scene& scene, std::mt19937_64& generator)
  : scene_(scene)
  , generator_(generator)
  , estimator_(fusedFitOptions())
  , sensor_(independentKinect())
  {}

  std::vector<Measurement> measure(const Pose& pose, const std::vector<Pose>& discs)
  {
    std::vector<Measurement> measurements;
    for (const Pose& disc : discs) {
      const SpotView seen(scene_, sensor_, pose, disc, kRadius, kStride);
      if (auto m = seen.measure(estimator_, generator_)) {
        m->id = measurements.size() + 1;
        measurements.push_back(*m);
      }
    }
    return measurements;
  }

private:
  const Scene& scene_;
  std::mt19937_64& generator_;
  PatchEstimator estimator_;
  Sensor sensor_;
};

/// Some of the patches where they seem to be to one who believes in a guess.
/// \param first pose of the sensor when the map was made.
std::vector<Pose>
believedDiscs(const PatchMap& map,
              const Pose& first,
              const Pose& truth,
              const Pose& guess,
              std::mt19937_64& generator)
{
  constexpr std::size_t kWanted = 300;
  std::vector<Pose> discs;
  for (const MapPatch& patch : map.patches())
    discs.push_back(first * truth * (guess.inverse() * patch.anchor));
  std::shuffle(discs.begin(), discs.end(), generator);
  discs.resize(std::min(discs.size(), kWanted));
  return discs;
}

RegistrationError
errorOf(const RegistrationResult& result, const Pose& truth)
{
  JetVector error;
  error << logMap(truth.R.transpose() * result.pose.R), result.pose.c - truth.c;
  return {observedError(error, result), result.pairs, result.gated};
}

} // namespace

std::optional<RegistrationError>
registerOnce(RegistrationGround ground, double guess_error, std::mt19937_64& generator)
{
  const Scene scene = sceneOf(ground, generator);
  Registration sensor(scene, generator);
  PatchMapOptions options;
  options.radius_m = kRadius;
  PatchMap map(options);
  const Pose first = viewFromAbove(generator);
  map.update(sensor.measure(first, discsOn(scene, generator)));
  const Pose second = viewFromAbove(generator);
  const Pose truth = first.inverse() * second;
  const Pose guess{truth.R * expMap(guess_error * normalVector(generator).normalized()),
                   truth.c + guess_error * normalVector(generator).normalized()};
  const RegistrationResult result = registerPatches(
      sensor.measure(second, believedDiscs(map, first, truth, guess, generator)),
      map,
      guess);
  if (result.status != RegistrationStatus::Converged)
    return std::nullopt;
  return errorOf(result, truth);
}

} // namespace holdfast::app
