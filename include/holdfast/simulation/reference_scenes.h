/// \file The two families of scenes on which covariances are checked.
#pragma once

#include <holdfast/simulation/scene.h>
#include <holdfast/simulation/simulator.h>

#include <random>

namespace holdfast {

/// One patch, in scene.patches[0], at the origin with its axes along the world's, the
/// sensor in scene.sensor_pose, and its rays.
struct ReferenceScene {
  Scene scene;
  RayGrid rays;
};

/// The patches of the paper's Table II, 1 to 2.5 m large, seen from (-1, -1, 6) by a
/// frustum of 60 x 60 degrees with 30 x 30 rays, up (0, 1, 0).
/// \throw std::invalid_argument when the type is not legal.
ReferenceScene tableTwoScene(PatchType type);

/// The Kinect of robotScene(), randomScene() and randomCloseScene(): 580 px.
Camera referenceCamera();

/// A patch of the size of a foot or hand, about 0.1 m, seen by a Kinect (580 px, every
/// sixth pixel).
/// \param distance from the sensor to the patch, m.
/// \param tilt angle between the patch normal and the line of sight, rad, below pi/2.
/// \param azimuth direction of the tilt, from local x towards y, rad.
/// \throw std::invalid_argument when the type is not legal, the distance not positive
/// or the tilt not in [0, pi/2).
ReferenceScene robotScene(PatchType type, double distance, double tilt, double azimuth);

/// A view nobody chose: a patch of the robot's kind, 2 to 25 cm large, curved by 0.05
/// to 0.8 over its radius, from 0.6 to 2 m at any tilt up to 1.1 rad, anywhere in the
/// image of that Kinect, at the stride (1 pixel or more) that leaves 60 to 5000 points;
/// sizes, curvatures and numbers of points in equal ratios. \throw
/// std::invalid_argument when the type is not legal.
ReferenceScene randomScene(PatchType type, std::mt19937_64& generator);

/// The same from 1 m, 3 to 10 cm large, at a stride of 1 to 6 pixels.
/// \throw std::invalid_argument when the type is not legal.
ReferenceScene randomCloseScene(PatchType type, std::mt19937_64& generator);

} // namespace holdfast
