/// \file Random valid patches and poses, and what parametrised tests over the ten types
/// need.
#pragma once

#include "support/random.h"

#include <holdfast/patch/parameters.h>
#include <holdfast/patch/patch.h>

#include <gtest/gtest.h>

#include <ostream>
#include <string>

namespace holdfast {

// Found by GoogleTest, which prints the parameter of a failing test with it.
inline void
PrintTo(PatchType type, std::ostream* out)
{
  *out << surfaceName(type.surface) << " bounded by " << boundaryName(type.boundary);
}

} // namespace holdfast

namespace holdfast::test {

/// Name of a test parametrised by the patch type, e.g. "plane_quad".
inline std::string
patchTypeName(const testing::TestParamInfo<PatchType>& info)
{
  return std::string(surfaceName(info.param.surface)) + "_" +
         std::string(boundaryName(info.param.boundary));
}

/// Any orientation, centre within `extent_m` of the origin along each axis.
inline Pose
randomPose(Random& random, double extent_m = 2.0)
{
  Pose pose;
  pose.R = random.rotation();
  pose.c = random.uniformVector(-extent_m, extent_m);
  return pose;
}

/// Bounds of 5-15 cm; gamma well inside (0, pi/2).
inline Eigen::Matrix<double, 5, 1>
randomBounds(Random& random, BoundaryType boundary)
{
  Eigen::Matrix<double, 5, 1> d = Eigen::Matrix<double, 5, 1>::Zero();
  for (int i = 0; i < boundaryParameterCount(boundary); ++i)
    d(i) = i < 4 ? random.uniform(0.05, 0.15) : random.uniform(0.3, 1.2);
  return d;
}

/// Curvatures of 2-6 1/m either way, so that no bound reaches a sphere's equator;
/// |kappa_x| clearly below |kappa_y| where there are two.
inline Eigen::Vector2d
randomCurvatures(Random& random, SurfaceType surface)
{
  if (surface == SurfaceType::Plane)
    return Eigen::Vector2d::Zero();
  if (curvatureParameterCount(surface) == 1)
    return {random.sign() * random.uniform(2.0, 6.0), 0.0};
  const double x = random.sign() * random.uniform(2.0, 3.5);
  const double y = random.uniform(4.5, 6.0);
  const bool elliptic = surface == SurfaceType::EllipticParaboloid;
  return {x, (x > 0.0) == elliptic ? y : -y};
}

/// A valid patch in canonical form at a random pose.
inline Patch
randomPatch(Random& random, PatchType type)
{
  Patch patch;
  patch.type = type;
  patch.d = randomBounds(random, type.boundary);
  patch.kappa = randomCurvatures(random, type.surface);
  return transformed(patch, randomPose(random));
}

} // namespace holdfast::test
