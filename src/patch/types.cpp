#include <holdfast/patch/names.h>
#include <holdfast/patch/types.h>

#include <algorithm>

namespace holdfast {
bool
isLegal(PatchType type)
{
  return std::find(kPatchTypes.begin(), kPatchTypes.end(), type) != kPatchTypes.end();
}

BoundaryType
defaultBoundary(SurfaceType surface)
{
  return traitsOf(surface).boundary;
}

bool
isParaboloid(SurfaceType surface)
{
  return traitsOf(surface).is_paraboloid;
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
  return traitsOf(surface).curvatures;
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
  return kSurfaceNames.of(surface);
}

std::string_view
boundaryName(BoundaryType boundary)
{
  return kBoundaryNames.of(boundary);
}

std::optional<SurfaceType>
surfaceFromName(std::string_view name)
{
  return kSurfaceNames.find(name);
}

std::optional<BoundaryType>
boundaryFromName(std::string_view name)
{
  return kBoundaryNames.find(name);
}

} // namespace holdfast
