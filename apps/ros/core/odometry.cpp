#include "core/odometry.h"

#include <holdfast/geometry/rotation.h>

namespace holdfast::robot {

JetMatrix
motionCovariance(const JetMatrix& velocity,
                 double seconds,
                 const Pose& motion,
                 const Pose& sensor)
{
  const Pose body = sensor * motion * sensor.inverse();
  // The sensor's motion is X^-1 (R Exp(delta), p + dp) X, X the sensor on the body.
  const Eigen::Matrix3d to_sensor = sensor.R.transpose();
  JetMatrix J = JetMatrix::Zero();
  J.topLeftCorner<3, 3>() = to_sensor;
  J.bottomLeftCorner<3, 3>() = -to_sensor * body.R * skew(sensor.c);
  J.bottomRightCorner<3, 3>() = to_sensor;
  return seconds * seconds * J * velocity * J.transpose();
}

} // namespace holdfast::robot
