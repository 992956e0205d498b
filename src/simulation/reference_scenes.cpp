#include <holdfast/geometry/constants.h>
#include <holdfast/simulation/reference_scenes.h>

#include "sensor/require.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

namespace holdfast {

namespace {

/// Boundary and curvature parameters of one patch.
struct Intrinsics {
  PatchType type;
  std::initializer_list<double> d;
  std::initializer_list<double> k;
};

/// The patch of that type in a list of all ten, at the origin, axes as the world's.
Patch
patchFrom(std::initializer_list<Intrinsics> patches, PatchType type)
{
  for (const Intrinsics& candidate : patches) {
    if (candidate.type != type)
      continue;
    Patch patch;
    patch.type = type;
    std::copy(candidate.d.begin(), candidate.d.end(), patch.d.begin());
    std::copy(candidate.k.begin(), candidate.k.end(), patch.kappa.begin());
    return patch;
  }
  throw std::invalid_argument("no legal patch type");
}

/// Paper, Table II.
Patch
tableTwoPatch(PatchType type)
{
  using S = SurfaceType;
  using B = BoundaryType;
  return patchFrom({{{S::EllipticParaboloid, B::Ellipse}, {1.5, 1.0}, {-1.0, -2.0}},
                    {{S::HyperbolicParaboloid, B::Ellipse}, {1.5, 1.0}, {0.5, -1.0}},
                    {{S::CylindricParaboloid, B::Rectangle}, {2.0, 0.8}, {-2.0}},
                    {{S::CircularParaboloid, B::Circle}, {1.8}, {-1.0}},
                    {{S::Plane, B::Ellipse}, {1.5, 1.0}, {}},
                    {{S::Plane, B::Circle}, {2.0}, {}},
                    {{S::Plane, B::Rectangle}, {1.7, 2.5}, {}},
                    {{S::Plane, B::Quad}, {2.3, 2.0, 1.7, 2.3, kPi / 4.0}, {}},
                    {{S::Sphere, B::Circle}, {1.8}, {-0.5}},
                    {{S::CircularCylinder, B::Rectangle}, {2.0, 1.8}, {-0.5}}},
                   type);
}

Patch
robotPatch(PatchType type)
{
  using S = SurfaceType;
  using B = BoundaryType;
  return patchFrom({{{S::EllipticParaboloid, B::Ellipse}, {0.12, 0.08}, {-5.0, -10.0}},
                    {{S::HyperbolicParaboloid, B::Ellipse}, {0.12, 0.08}, {5.0, -10.0}},
                    {{S::CylindricParaboloid, B::Rectangle}, {0.12, 0.08}, {-10.0}},
                    {{S::CircularParaboloid, B::Circle}, {0.1}, {-8.0}},
                    {{S::Plane, B::Ellipse}, {0.12, 0.08}, {}},
                    {{S::Plane, B::Circle}, {0.1}, {}},
                    {{S::Plane, B::Rectangle}, {0.12, 0.08}, {}},
                    {{S::Plane, B::Quad}, {0.12, 0.1, 0.11, 0.12, kPi / 6.0}, {}},
                    {{S::Sphere, B::Circle}, {0.1}, {-6.0}},
                    {{S::CircularCylinder, B::Rectangle}, {0.12, 0.09}, {-6.0}}},
                   type);
}

ReferenceScene
sceneOf(const std::string& name,
        const Patch& patch,
        const Eigen::Vector3d& sensor_position,
        const RayGrid& rays)
{
  ReferenceScene result;
  result.scene.name = name;
  result.scene.patches = {patch};
  result.scene.sensor_pose = lookAt(sensor_position, patch.c, Eigen::Vector3d::UnitY());
  result.rays = rays;
  return result;
}

Eigen::Vector3d
lineOfSight(double tilt, double azimuth)
{
  return {std::sin(tilt) * std::cos(azimuth),
          std::sin(tilt) * std::sin(azimuth),
          std::cos(tilt)};
}

/// Draws in the order they are asked for.
class Draw {
public:
  explicit Draw(std::mt19937_64& generator) : generator_(generator) {}

  double uniform(double low, double high)
  {
    return low + (high - low) * std::generate_canonical<double, 53>(generator_);
  }

  /// In equal ratios.
  double ratio(double low, double high)
  {
    return std::exp(uniform(std::log(low), std::log(high)));
  }

private:
  std::mt19937_64& generator_;
};

/// The robot's patch, `radius` large and curved by `bend` over it, its two curvatures
/// at any ratio.
Patch
scaledPatch(PatchType type, double radius, double bend, double share)
{
  constexpr double kRobotRadius = 0.1;
  Patch patch = robotPatch(type);
  const double scale = radius / kRobotRadius;
  const int bounds =
      type.boundary == BoundaryType::Quad ? 4 : boundaryParameterCount(type.boundary);
  patch.d.head(bounds) *= scale;
  const int curvatures = curvatureParameterCount(type.surface);
  if (curvatures == 1)
    patch.kappa[0] = -bend / radius;
  else if (curvatures == 2)
    patch.kappa << std::copysign(share * bend / radius, patch.kappa[0]), -bend / radius;
  return patch;
}

/// How a random patch is seen: metres, radians.
struct View {
  double distance, tilt, azimuth;
  double radius; ///< of the patch
  double bend, share; ///< of scaledPatch()
  double aside, direction; ///< of the patch from the middle of the image
  int stride;
};

ReferenceScene
sceneOf(const View& view, PatchType type)
{
  ReferenceScene result = sceneOf("random",
                                  scaledPatch(type, view.radius, view.bend, view.share),
                                  view.distance * lineOfSight(view.tilt, view.azimuth),
                                  pixelRays(referenceCamera(), view.stride));
  const Pose& pose = result.scene.sensor_pose;
  const Eigen::Vector3d target =
      view.aside * (std::cos(view.direction) * pose.R.col(0) +
                    std::sin(view.direction) * pose.R.col(1));
  result.scene.sensor_pose = lookAt(pose.c, target, Eigen::Vector3d::UnitY());
  return result;
}

} // namespace

Camera
referenceCamera()
{
  Camera kinect;
  kinect.fx = kinect.fy = 580.0;
  return kinect;
}

ReferenceScene
tableTwoScene(PatchType type)
{
  return sceneOf("table_two",
                 tableTwoPatch(type),
                 {-1.0, -1.0, 6.0},
                 frustumRays(30, kPi / 3.0));
}

ReferenceScene
robotScene(PatchType type, double distance, double tilt, double azimuth)
{
  requirePositive("distance", distance);
  if (!(tilt >= 0.0 && tilt < kPi / 2.0))
    throw std::invalid_argument("tilt must lie in [0, pi/2)");
  return sceneOf("robot",
                 robotPatch(type),
                 distance * lineOfSight(tilt, azimuth),
                 pixelRays(referenceCamera(), 6));
}

ReferenceScene
randomScene(PatchType type, std::mt19937_64& generator)
{
  Draw draw(generator);
  View view{};
  view.distance = draw.uniform(0.6, 2.0);
  view.tilt = draw.uniform(0.0, 1.1);
  view.azimuth = draw.uniform(0.0, 2.0 * kPi);
  view.radius = draw.ratio(0.02, 0.25);
  const double points = draw.ratio(60.0, 5000.0);
  view.bend = draw.ratio(0.05, 0.8);
  view.share = draw.uniform(0.05, 1.0);
  view.aside = draw.uniform(0.0, 0.3) * view.distance;
  view.direction = draw.uniform(0.0, 2.0 * kPi);
  const Camera camera = referenceCamera();
  const double pixels = kPi * view.radius * view.radius * std::cos(view.tilt) *
                        camera.fx * camera.fy / (view.distance * view.distance);
  view.stride = std::max(1, static_cast<int>(std::sqrt(pixels / points)));
  return sceneOf(view, type);
}

ReferenceScene
randomCloseScene(PatchType type, std::mt19937_64& generator)
{
  constexpr int kStrides = 6;
  Draw draw(generator);
  View view{};
  view.distance = 1.0;
  view.tilt = draw.uniform(0.0, 1.1);
  view.azimuth = draw.uniform(0.0, 2.0 * kPi);
  view.radius = draw.ratio(0.03, 0.10);
  view.bend = draw.ratio(0.05, 0.8);
  view.share = draw.uniform(0.05, 1.0);
  view.aside = draw.uniform(0.0, 0.3);
  view.direction = draw.uniform(0.0, 2.0 * kPi);
  view.stride = 1 + static_cast<int>(draw.uniform(0.0, kStrides));
  return sceneOf(view, type);
}

} // namespace holdfast
