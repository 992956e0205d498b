/// \file Depth noise of a time-of-flight camera, by depth and incidence.
#pragma once

#include <holdfast/sensor/noise_model.h>

namespace holdfast {

/// Fankhauser, Bloesch, Rodriguez, Kaestner, Hutter and Siegwart, "Kinect v2 for mobile
/// robot navigation: evaluation and modeling", ICAR 2015, indoors: the standard
/// deviation of the depth z of a surface whose normal is at the angle theta to the ray,
///
///   sigma_z = 1.5 - 0.5 z + 0.3 z^2
///             + 0.1 z^(3/2) theta^2 / (pi/2 - theta)^2   (mm, z in m),
///
/// where the quadratic is written by its smallest value, sigma_m at z = best_depth_m.
/// Depth errors move the point along its ray; sigma_point_px of a pixel across it is
/// added as in KhoshelhamNoiseModel,
///
///   Sigma = sigma_z^2 (q/z) (q/z)^T + (sigma_point z / f)^2 diag(1, 1, 0).
///
/// In an image, theta is that of the plane through the pixels around
/// (imageCovariances), at most 80 degrees, where the formula runs away and hardly any
/// light returns. A single point, and a pixel with too few neighbours for a plane,
/// counts as facing the sensor: its covariance is the smallest that the model has.
class TimeOfFlightNoiseModel : public NoiseModel {
public:
  /// The defaults are those of a second-generation Kinect.
  struct Parameters {
    double sigma_m = 1.5e-3 - 0.25e-3 / 1.2; ///< at best_depth_m, facing
    double sigma_per_m2 = 0.3e-3; ///< times (z - best_depth_m)^2
    double best_depth_m = 0.5 / 0.6;
    double sigma_incidence_m = 0.1e-3; ///< of the term in theta, at a depth of 1 m
    double sigma_point_px = 0.29;
    double focal_px = 365.0;
  };

  /// \throw ParameterError for a negative number, a focal length that is not positive,
  /// or a number that is not finite.
  explicit TimeOfFlightNoiseModel(const Parameters& parameters);

  /// Of a point on a surface that faces the sensor.
  Eigen::Matrix3d covariance(const Eigen::Vector3d& q) const override;
  /// \param theta_rad angle between the ray to q and the normal of the surface there,
  /// 0 to pi/2.
  Eigen::Matrix3d covariance(const Eigen::Vector3d& q, double theta_rad) const;
  std::vector<Eigen::Matrix3f> imageCovariances(
      const std::vector<Eigen::Vector3d>& points,
      int width,
      int height) const override;
  bool dependsOnNeighbors() const override
  {
    return true;
  }
  std::string name() const override;

private:
  Parameters parameters_;
};

} // namespace holdfast
