/// \file What an odometry's velocities say of the sensor's motion.
#pragma once

#include <holdfast/fusion/jet.h>
#include <holdfast/geometry/pose.h>

#include <string>

namespace holdfast::robot {

/// What is known of a body's velocity.
struct VelocityError {
  /// Of angular and linear velocity, (rad/s)^2 and (m/s)^2, axes of the body.
  JetMatrix covariance = JetMatrix::Zero();
  std::string frame_id; ///< of the body
};

/// Covariance of a sensor's motion, as PatchMap::move() takes it, where the velocity of
/// the body that carries it was off by the same amount for so many seconds.
/// \param motion of the sensor, its new pose in its old frame.
/// \param sensor its pose on the body.
JetMatrix motionCovariance(const JetMatrix& velocity,
                           double seconds,
                           const Pose& motion,
                           const Pose& sensor);

} // namespace holdfast::robot
