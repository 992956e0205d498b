/// \file Names of neighbourhoods and of the ways to choose seeds.
#pragma once

#include <holdfast/patch/names.h>
#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/pcl/patch_extraction.h>

namespace holdfast {

inline constexpr EnumNames<Neighborhood, 5> kNeighborhoodNames{
    {"patch", "disc", "ball", "geodesic", "knn"}};

inline constexpr EnumNames<SeedStrategy, 3> kSeedStrategyNames{
    {"grid", "random", "poisson"}};

inline constexpr EnumNames<NormalSide, 3> kNormalSideNames{
    {"viewpoint", "outward", "up"}};

} // namespace holdfast
