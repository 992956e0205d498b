/// \file The ten bounded patch types as data (paper Fig. 1 and Table I).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace holdfast {

enum class SurfaceType : std::uint8_t {
  Plane,
  Sphere,
  CircularCylinder,
  EllipticParaboloid,
  HyperbolicParaboloid,
  CylindricParaboloid,
  CircularParaboloid
};

enum class BoundaryType : std::uint8_t { Ellipse, Circle, Rectangle, Quad };

struct PatchType {
  SurfaceType surface = SurfaceType::Plane;
  BoundaryType boundary = BoundaryType::Ellipse;
};

constexpr bool
operator==(PatchType a, PatchType b)
{
  return a.surface == b.surface && a.boundary == b.boundary;
}

constexpr bool
operator!=(PatchType a, PatchType b)
{
  return !(a == b);
}

/// The ten legal pairs, in the order of the paper's Table I.
inline constexpr std::array<PatchType, 10> kPatchTypes{{
    {SurfaceType::EllipticParaboloid, BoundaryType::Ellipse},
    {SurfaceType::HyperbolicParaboloid, BoundaryType::Ellipse},
    {SurfaceType::CylindricParaboloid, BoundaryType::Rectangle},
    {SurfaceType::CircularParaboloid, BoundaryType::Circle},
    {SurfaceType::Plane, BoundaryType::Ellipse},
    {SurfaceType::Plane, BoundaryType::Circle},
    {SurfaceType::Plane, BoundaryType::Rectangle},
    {SurfaceType::Plane, BoundaryType::Quad},
    {SurfaceType::Sphere, BoundaryType::Circle},
    {SurfaceType::CircularCylinder, BoundaryType::Rectangle},
}};

/// Most parameters any type has: the plane bounded by a convex quad.
inline constexpr int kMaxParameters = 11;

bool isLegal(PatchType type);

/// The boundary that a surface implies; planes may have any, the ellipse is theirs by
/// default.
BoundaryType defaultBoundary(SurfaceType surface);

bool isParaboloid(SurfaceType surface);

/// A revolute patch looks the same turned about its z axis: its orientation is r_xy.
bool isRevolute(PatchType type);

/// Number of boundary parameters d: ellipse 2, circle 1, rectangle 2, quad 5.
int boundaryParameterCount(BoundaryType boundary);

/// Number of curvature parameters: 0, 1 or 2.
int curvatureParameterCount(SurfaceType surface);

/// Number of rotation parameters: 2 for revolute types, else 3.
int rotationParameterCount(PatchType type);

/// Boundary + curvature + rotation + 3.
int degreesOfFreedom(PatchType type);

/// Names as in the program's JSON: "elliptic_paraboloid", "circular_cylinder", ...
std::string_view surfaceName(SurfaceType surface);
std::string_view boundaryName(BoundaryType boundary);
std::optional<SurfaceType> surfaceFromName(std::string_view name);
std::optional<BoundaryType> boundaryFromName(std::string_view name);

} // namespace holdfast
