#include "support/random_patch.h"

#include <holdfast/patch/types.h>

#include <set>

namespace holdfast { namespace {

constexpr std::array<SurfaceType, 7> kSurfaces{SurfaceType::Plane,
                                               SurfaceType::Sphere,
                                               SurfaceType::CircularCylinder,
                                               SurfaceType::EllipticParaboloid,
                                               SurfaceType::HyperbolicParaboloid,
                                               SurfaceType::CylindricParaboloid,
                                               SurfaceType::CircularParaboloid};

constexpr std::array<BoundaryType, 4> kBoundaries{BoundaryType::Ellipse,
                                                  BoundaryType::Circle,
                                                  BoundaryType::Rectangle,
                                                  BoundaryType::Quad};

TEST(PatchTypes, TenPairsAreLegal)
{
  int legal = 0;
  for (const SurfaceType surface : kSurfaces)
    for (const BoundaryType boundary : kBoundaries)
      legal += isLegal({surface, boundary}) ? 1 : 0;
  EXPECT_EQ(legal, 10);
  for (const PatchType type : kPatchTypes)
    EXPECT_TRUE(isLegal(type));
}

TEST(PatchTypes, DegreesOfFreedomAreThePapers)
{
  // Paper Table I, in its order.
  const std::array<int, 10> expected{10, 10, 9, 7, 8, 6, 8, 11, 7, 9};
  for (std::size_t i = 0; i < kPatchTypes.size(); ++i) {
    EXPECT_EQ(degreesOfFreedom(kPatchTypes[i]), expected[i]);
    EXPECT_LE(expected[i], kMaxParameters);
  }
}

TEST(PatchTypes, DefaultBoundariesAreLegal)
{
  for (const SurfaceType surface : kSurfaces)
    EXPECT_TRUE(isLegal({surface, defaultBoundary(surface)}));
  EXPECT_EQ(defaultBoundary(SurfaceType::Plane), BoundaryType::Ellipse);
}

TEST(PatchTypes, ParaboloidsAreFour)
{
  int paraboloids = 0;
  for (const SurfaceType surface : kSurfaces)
    paraboloids += isParaboloid(surface) ? 1 : 0;
  EXPECT_EQ(paraboloids, 4);
  EXPECT_FALSE(isParaboloid(SurfaceType::Plane));
  EXPECT_FALSE(isParaboloid(SurfaceType::Sphere));
  EXPECT_FALSE(isParaboloid(SurfaceType::CircularCylinder));
}

TEST(PatchTypes, RevoluteTypesHaveTwoRotations)
{
  for (const PatchType type : kPatchTypes) {
    EXPECT_EQ(isRevolute(type), type.boundary == BoundaryType::Circle);
    EXPECT_EQ(rotationParameterCount(type), isRevolute(type) ? 2 : 3);
  }
}

TEST(PatchTypes, NamesRoundTripAndDiffer)
{
  std::set<std::string_view> names;
  for (const SurfaceType surface : kSurfaces) {
    names.insert(surfaceName(surface));
    EXPECT_EQ(surfaceFromName(surfaceName(surface)), surface);
  }
  for (const BoundaryType boundary : kBoundaries) {
    names.insert(boundaryName(boundary));
    EXPECT_EQ(boundaryFromName(boundaryName(boundary)), boundary);
  }
  EXPECT_EQ(names.size(), 11u);
  EXPECT_EQ(surfaceFromName("circle"), std::nullopt);
  EXPECT_EQ(boundaryFromName(""), std::nullopt);
}

}} // namespace holdfast
