#include <holdfast/patch/types.h>

#include <algorithm>

namespace holdfast {
namespace {

constexpr std::array<std::string_view, 7> kSurfaceNames{"plane",
                                                        "sphere",
                                                        "circular_cylinder",
                                                        "elliptic_paraboloid",
                                                        "hyperbolic_paraboloid",
                                                        "cylindric_paraboloid",
                                                        "circular_paraboloid"};

constexpr std::array<std::string_view, 4> kBoundaryNames{"ellipse",
                                                         "circle",
                                                         "rectangle",
                                                         "quad"};

// The enumerator whose name is at the same place in the table.
template <typename Enum, std::size_t N>
std::optional<Enum>
fromName(const std::array<std::string_view, N>& names, std::string_view name)
{
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    return std::nullopt;
  return static_cast<Enum>(found - names.begin());
}

} // namespace

bool
isLegal(PatchType type)
{
  return std::find(kPatchTypes.begin(), kPatchTypes.end(), type) != kPatchTypes.end();
}

BoundaryType
defaultBoundary(SurfaceType surface)
{
  switch (surface) {
  case SurfaceType::Sphere:
  case SurfaceType::CircularParaboloid:
    return BoundaryType::Circle;
  case SurfaceType::CircularCylinder:
  case SurfaceType::CylindricParaboloid:
    return BoundaryType::Rectangle;
  case SurfaceType::Plane:
  case SurfaceType::EllipticParaboloid:
  case SurfaceType::HyperbolicParaboloid:
    break;
  }
  return BoundaryType::Ellipse;
}

bool
isParaboloid(SurfaceType surface)
{
  return surface == SurfaceType::EllipticParaboloid ||
         surface == SurfaceType::HyperbolicParaboloid ||
         surface == SurfaceType::CylindricParaboloid ||
         surface == SurfaceType::CircularParaboloid;
}

bool
isRevolute(PatchType type)
{
  // Every surface that may have a circular boundary is itself a surface of revolution.
  return type.boundary == BoundaryType::Circle;
}

int
boundaryParameterCount(BoundaryType boundary)
{
  switch (boundary) {
  case BoundaryType::Circle:
    return 1;
  case BoundaryType::Quad:
    return 5;
  case BoundaryType::Ellipse:
  case BoundaryType::Rectangle:
    break;
  }
  return 2;
}

int
curvatureParameterCount(SurfaceType surface)
{
  switch (surface) {
  case SurfaceType::Plane:
    return 0;
  case SurfaceType::EllipticParaboloid:
  case SurfaceType::HyperbolicParaboloid:
    return 2;
  case SurfaceType::Sphere:
  case SurfaceType::CircularCylinder:
  case SurfaceType::CylindricParaboloid:
  case SurfaceType::CircularParaboloid:
    break;
  }
  return 1;
}

int
rotationParameterCount(PatchType type)
{
  return isRevolute(type) ? 2 : 3;
}

int
degreesOfFreedom(PatchType type)
{
  return boundaryParameterCount(type.boundary) + curvatureParameterCount(type.surface) +
         rotationParameterCount(type) + 3;
}

std::string_view
surfaceName(SurfaceType surface)
{
  return kSurfaceNames.at(static_cast<std::size_t>(surface));
}

std::string_view
boundaryName(BoundaryType boundary)
{
  return kBoundaryNames.at(static_cast<std::size_t>(boundary));
}

std::optional<SurfaceType>
surfaceFromName(std::string_view name)
{
  return fromName<SurfaceType>(kSurfaceNames, name);
}

std::optional<BoundaryType>
boundaryFromName(std::string_view name)
{
  return fromName<BoundaryType>(kBoundaryNames, name);
}

} // namespace holdfast
