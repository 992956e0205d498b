/// \file Measurements of patches, and maps of ground to step on.
#pragma once

#include "support/random.h"

#include <holdfast/fusion/patch_map.h>

#include <Eigen/Geometry>

#include <cmath>
#include <vector>

namespace holdfast::test {

/// A patch as a depth camera's of that radius at 1 m, seen all over its disc.
inline Measurement
groundMeasurement(std::uint64_t id, const Pose& anchor, double radius_m)
{
  Measurement m;
  m.id = id;
  m.anchor = anchor;
  m.jet.white = (JetVector() << 4e-4, 0.005, 0.005, 0.2, 0.15, 0.2)
                    .finished()
                    .cwiseAbs2()
                    .asDiagonal();
  m.radius_m = radius_m;
  m.points = 140;
  const double moment = radius_m * radius_m / 4.0;
  m.moments = {moment, 0.0, moment};
  m.moments_covariance = 1e-12 * Eigen::Matrix3d::Identity();
  m.design.by_third = thirdToJetOfDisc(radius_m);
  for (int row = 0; row < SupportGrid::kCells; ++row)
    for (int column = 0; column < SupportGrid::kCells; ++column)
      if (std::hypot(SupportGrid::middle(row), SupportGrid::middle(column)) <= 1.0)
        m.support.set(column, row);
  m.chi2 = m.chi2_expected = 134.0;
  return m;
}

/// side x side patches 1.2 radii apart about the z axis, z up, that tilt and bend, as a
/// sensor 1 m above sees them.
inline PatchMap
roughGround(int side, double radius_m, Random& random)
{
  PatchMap::Snapshot empty;
  empty.options.radius_m = radius_m;
  empty.pose.R = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  empty.pose.c.z() = 1.0;
  const Pose to_sensor = empty.pose.inverse();
  std::vector<Measurement> measurements;
  const double step = 1.2 * radius_m;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const double yaw = random.uniform(-3.0, 3.0), tilt = random.uniform(0.0, 0.5);
      Pose anchor;
      anchor.R = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()))
                     .toRotationMatrix();
      anchor.c = {step * (i - 0.5 * side),
                  step * (j - 0.5 * side),
                  random.uniform(-0.01, 0.01)};
      Measurement m =
          groundMeasurement(measurements.size() + 1, to_sensor * anchor, radius_m);
      m.jet.value.tail<3>() << random.uniform(-8.0, 2.0), random.uniform(-2.0, 2.0),
          random.uniform(-8.0, 2.0);
      measurements.push_back(m);
    }
  PatchMap map(empty);
  map.update(measurements);
  return map;
}

} // namespace holdfast::test
