/// \file A spot of a curved surface before a Kinect, from anywhere around it.
#pragma once

#include "support/random.h"

#include <holdfast/evaluation/spot_view.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/simulation/relief.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace holdfast::test {

inline Sensor
kinect()
{
  Sensor sensor;
  sensor.name = "kinect";
  sensor.camera = referenceCamera();
  sensor.noise =
      std::make_shared<const StereoNoiseModel>(StereoNoiseModel::Parameters{});
  return sensor;
}

/// Third derivatives of an isotropic random field, root mean square s3, 1/m^2
/// (fusion/roughness.h).
inline Eigen::Vector4d
randomThirdDerivatives(Random& random, double s3)
{
  // xxx and xyy share a part, as do xxy and yyy.
  const double share = std::sqrt(0.2);
  const double a = random.normal(), b = random.normal(), c = random.normal(),
               d = random.normal();
  const double rest = std::sqrt(1.0 - share * share);
  return s3 * Eigen::Vector4d(share * a + rest * b,
                              share * c,
                              share * a,
                              share * c + rest * d);
}

/// z = (-5 x^2 - 10 y^2)/2 and third derivatives, at the origin, z up.
inline Scene
reliefScene(const Eigen::Vector4d& third = Eigen::Vector4d::Zero(),
            const Eigen::Vector3d& second = {-5.0, 0.0, -10.0})
{
  constexpr double kRadius = 0.12;
  Scene scene;
  scene.shapes.push_back(std::make_shared<Relief>(Pose(), second, third, kRadius));
  return scene;
}

/// From 0.8 to 1.2 m at a tilt of 0.2 to 0.8 rad and any azimuth, looking near a place.
inline Pose
randomView(Random& random, const Eigen::Vector3d& place = Eigen::Vector3d::Zero())
{
  const double distance = random.uniform(0.8, 1.2), tilt = random.uniform(0.2, 0.8),
               azimuth = random.uniform(0.0, 6.283);
  const Eigen::Vector3d direction(std::sin(tilt) * std::cos(azimuth),
                                  std::sin(tilt) * std::sin(azimuth),
                                  std::cos(tilt));
  const Eigen::Vector3d target = place + random.uniformVector(-0.1, 0.1);
  return lookAt(place + distance * direction, target, random.unitVector());
}

/// A disc about a place on a surface, its plane level.
inline Pose
discAt(const Eigen::Vector3d& place)
{
  Pose disc;
  disc.c = place;
  return disc;
}

inline FitOptions
paraboloidOptions()
{
  FitOptions options;
  options.surface = SurfaceRequest::Paraboloid;
  options.separate_pattern = true;
  return options;
}

/// (x - truth)^T P^-1 (x - truth), chi-square of six.
inline double
nees(const JetVector& x, const JetMatrix& P, const JetVector& truth)
{
  const JetVector scale = P.diagonal().cwiseSqrt().cwiseInverse();
  const JetMatrix C = scale.asDiagonal() * P * scale.asDiagonal();
  const JetVector e = scale.cwiseProduct(x - truth);
  return e.dot(C.llt().solve(e));
}

} // namespace holdfast::test
