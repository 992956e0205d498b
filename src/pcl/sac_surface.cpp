#include "sac_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

using kernel::Model;
using Coefficients = Eigen::VectorXd;

// ---- Plane, sphere, cylinder: coefficients as PCL has them ----------------------

std::optional<Patch>
planeFrom(const Coefficients& abcd)
{
  const Eigen::Vector3d normal = abcd.head<3>();
  return planePatch(normal, -abcd[3] / normal.squaredNorm() * normal);
}

Coefficients
planeCoefficients(const Patch& patch)
{
  const Eigen::Vector3d normal = patch.normal();
  Coefficients abcd(4);
  abcd << normal, -normal.dot(patch.c);
  return abcd;
}

// Of a sphere or cylinder: the point 1/kappa above the patch's centre.
Eigen::Vector3d
centreOfCurvature(const Patch& patch)
{
  return patch.c + patch.normal() / patch.kappa[0];
}

std::optional<Patch>
sphereFrom(const Coefficients& coefficients)
{
  return spherePatch(coefficients.head<3>(), coefficients[3]);
}

Coefficients
sphereCoefficients(const Patch& patch)
{
  Coefficients coefficients(4);
  coefficients << centreOfCurvature(patch), 1.0 / std::abs(patch.kappa[0]);
  return coefficients;
}

std::optional<Patch>
cylinderFrom(const Coefficients& coefficients)
{
  return cylinderPatch(coefficients.head<3>(),
                       coefficients.segment<3>(3),
                       coefficients[6]);
}

Coefficients
cylinderCoefficients(const Patch& patch)
{
  Coefficients coefficients(7);
  coefficients << centreOfCurvature(patch), patch.pose().R.col(0),
      1.0 / std::abs(patch.kappa[0]);
  return coefficients;
}

// ---- Paraboloids: [k | r | c] in the order of the library's parameters ----------

PatchType
boundedType(SurfaceType surface)
{
  return {surface, defaultBoundary(surface)};
}

bool
hasCurvaturesOf(SurfaceType surface, const Eigen::Vector2d& kappa)
{
  switch (surface) {
  case SurfaceType::EllipticParaboloid:
    return kappa.prod() > 0.0;
  case SurfaceType::HyperbolicParaboloid:
    return kappa.prod() < 0.0;
  default:
    return kappa.x() != 0.0;
  }
}

template <SurfaceType surface>
std::optional<Patch>
paraboloidFrom(const Coefficients& coefficients)
{
  const PatchType type = boundedType(surface);
  ParameterVector parameters = ParameterVector::Zero(layoutOf(type).size());
  parameters.tail(coefficients.size()) = coefficients;
  const Patch patch = unpack(type, parameters);
  if (!hasCurvaturesOf(surface, patch.kappa))
    return std::nullopt;
  return patch;
}

Coefficients
paraboloidCoefficients(const Patch& patch)
{
  const ParameterLayout layout = layoutOf(patch.type);
  return pack(patch).tail(layout.size() - layout.d_count);
}

// With curvatures of either sign, or none: the layout is that of two curvatures.
std::optional<Patch>
anyParaboloidFrom(const Coefficients& coefficients)
{
  Patch patch;
  patch.kappa = coefficients.head<2>();
  patch.type =
      boundedType(patch.kappa.prod() < 0.0 ? SurfaceType::HyperbolicParaboloid :
                                             SurfaceType::EllipticParaboloid);
  patch.r = coefficients.segment<3>(2);
  patch.c = coefficients.tail<3>();
  return patch;
}

Coefficients
anyParaboloidCoefficients(const Patch& patch)
{
  Coefficients coefficients(8);
  coefficients << patch.principalCurvatures(), patch.r, patch.c;
  return coefficients;
}

// ---- The table ------------------------------------------------------------------

template <std::optional<Patch> (*solve)(const Sample&)>
std::optional<Patch>
withoutFit(const Sample& sample, const Eigen::Vector3d&, const PatchFitter&)
{
  return solve(sample);
}

constexpr SacSurface
anyParaboloid(SurfaceRequest request, int model_type)
{
  return {request,
          model_type,
          Model::Paraboloid,
          6,
          8,
          paraboloidThrough,
          anyParaboloidFrom,
          anyParaboloidCoefficients};
}

template <SurfaceType surface>
constexpr SacSurface
typedParaboloid(SurfaceRequest request, int model_type, unsigned int model_size)
{
  return {request,
          model_type,
          Model::Paraboloid,
          6,
          model_size,
          paraboloidThrough,
          paraboloidFrom<surface>,
          paraboloidCoefficients};
}

constexpr std::array kSurfaces{
    SacSurface{SurfaceRequest::Plane,
               pcl::SACMODEL_PLANE,
               Model::Plane,
               3,
               4,
               withoutFit<planeThrough>,
               planeFrom,
               planeCoefficients},
    SacSurface{SurfaceRequest::Sphere,
               pcl::SACMODEL_SPHERE,
               Model::Sphere,
               4,
               4,
               withoutFit<sphereThrough>,
               sphereFrom,
               sphereCoefficients},
    SacSurface{SurfaceRequest::CircularCylinder,
               pcl::SACMODEL_CYLINDER,
               Model::Cylinder,
               6,
               7,
               withoutFit<cylinderThrough>,
               cylinderFrom,
               cylinderCoefficients},
    anyParaboloid(SurfaceRequest::Auto, SACMODEL_PATCH),
    anyParaboloid(SurfaceRequest::Paraboloid, SACMODEL_PARABOLOID),
    typedParaboloid<SurfaceType::EllipticParaboloid>(SurfaceRequest::EllipticParaboloid,
                                                     SACMODEL_ELLIPTIC_PARABOLOID,
                                                     8),
    typedParaboloid<SurfaceType::HyperbolicParaboloid>(
        SurfaceRequest::HyperbolicParaboloid,
        SACMODEL_HYPERBOLIC_PARABOLOID,
        8),
    typedParaboloid<SurfaceType::CylindricParaboloid>(
        SurfaceRequest::CylindricParaboloid,
        SACMODEL_CYLINDRIC_PARABOLOID,
        7),
    typedParaboloid<SurfaceType::CircularParaboloid>(SurfaceRequest::CircularParaboloid,
                                                     SACMODEL_CIRCULAR_PARABOLOID,
                                                     6),
};

} // namespace

const SacSurface&
sacSurface(SurfaceRequest request)
{
  const auto row = std::find_if(kSurfaces.begin(), kSurfaces.end(), [&](const auto& s) {
    return s.request == request;
  });
  if (row == kSurfaces.end())
    throw std::invalid_argument("sample consensus does not know this surface");
  return *row;
}

std::optional<SurfaceRequest>
surfaceOfModelType(int model_type)
{
  for (const SacSurface& surface : kSurfaces)
    if (surface.model_type == model_type)
      return surface.request;
  return std::nullopt;
}

} // namespace holdfast
