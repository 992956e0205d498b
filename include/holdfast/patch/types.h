/// \file The ten bounded patch types as data (paper Fig. 1 and Table I).
#pragma once

#include <array>
#include <cstddef>
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

/// What a surface is, apart from how it is fitted.
struct SurfaceTraits {
  BoundaryType boundary; ///< that it implies; a plane may have any
  int curvatures; ///< number of curvature parameters
  /// Which of the curvature parameters is the curvature along x and y; kStraight: none.
  int along_x, along_y;
  bool is_paraboloid;
  bool is_round; ///< closes around its centre or axis, with an equator as its end
};

inline constexpr int kStraight = -1;

/// In the order of SurfaceType.
inline constexpr std::array<SurfaceTraits, 7> kSurfaceTraits{{
    {BoundaryType::Ellipse, 0, kStraight, kStraight, false, false}, // plane
    {BoundaryType::Circle, 1, 0, 0, false, true}, // sphere
    {BoundaryType::Rectangle, 1, kStraight, 0, false, true}, // circular cylinder
    {BoundaryType::Ellipse, 2, 0, 1, true, false}, // elliptic paraboloid
    {BoundaryType::Ellipse, 2, 0, 1, true, false}, // hyperbolic paraboloid
    {BoundaryType::Rectangle, 1, kStraight, 0, true, false}, // cylindric paraboloid
    {BoundaryType::Circle, 1, 0, 0, true, false}, // circular paraboloid
}};
static_assert(kSurfaceTraits.size() ==
                  static_cast<std::size_t>(SurfaceType::CircularParaboloid) + 1,
              "every surface has its traits");

/// \throw std::out_of_range for what is not in the enumeration.
constexpr const SurfaceTraits&
traitsOf(SurfaceType surface)
{
  return kSurfaceTraits.at(static_cast<std::size_t>(surface));
}

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
