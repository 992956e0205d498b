/// \file Gaussian noise of one range measurement: a 3x3 covariance per point.
#pragma once

#include <Eigen/Core>

#include <memory>
#include <string>
#include <vector>

namespace holdfast {

/// Six channels of symmetric 3x3 matrices for many points, structure of arrays.
struct CovarianceChannels {
  double* xx = nullptr;
  double* xy = nullptr;
  double* xz = nullptr;
  double* yy = nullptr;
  double* yz = nullptr;
  double* zz = nullptr;
};

/// Covariance of the noise of a point, both in the camera frame (x right, y down, z
/// along the optical axis; metres, metres^2).
///
/// A new sensor is one small class derived from this, or a YAML file with the
/// parameters of an existing model (config/sensors).
class NoiseModel {
public:
  using Ptr = std::shared_ptr<NoiseModel>;
  using ConstPtr = std::shared_ptr<const NoiseModel>;

  virtual ~NoiseModel() = default;

  /// \param q point with z > 0, camera frame. Positive semi-definite; all six entries.
  virtual Eigen::Matrix3d covariance(const Eigen::Vector3d& q) const = 0;

  /// The same for n points at once; models on the hot path override it with a loop a
  /// compiler can vectorise.
  virtual void covariances(int n,
                           const double* x,
                           const double* y,
                           const double* z,
                           const CovarianceChannels& out) const;

  /// Covariances of an organized image of points, row by row, for models in which a
  /// pixel's noise depends on its neighbours; by default each pixel on its own.
  /// \param points width * height points, camera frame; invalid: NaN or z <= 0.
  /// \return one matrix per pixel, NaN where the point is invalid.
  /// \throw std::invalid_argument when the number of points is not width * height.
  virtual std::vector<Eigen::Matrix3f> imageCovariances(
      const std::vector<Eigen::Vector3d>& points,
      int width,
      int height) const;

  /// How the point q moves with the error that neighbouring pixels share (Sensor's
  /// pattern), per unit of it, camera frame. Here along the ray, m per m at a range of
  /// 1 m: the pattern grows with range as the standard deviation along the ray does.
  /// \param q point with z > 0.
  virtual Eigen::Vector3d patternDirection(const Eigen::Vector3d& q) const;

  /// The same for n points at once. The arrays of points and directions may not
  /// overlap.
  virtual void patternDirections(int n,
                                 const double* const point[3],
                                 double* const direction[3]) const;

  /// True when a pixel's noise depends on its neighbours: organized clouds then get
  /// their covariances from imageCovariances().
  virtual bool dependsOnNeighbors() const
  {
    return false;
  }

  /// True when covariance() holds for points in every direction around the sensor, not
  /// only for those in front of a camera.
  virtual bool isOmnidirectional() const
  {
    return false;
  }

  /// Name in YAML files and results, e.g. "stereo".
  virtual std::string name() const = 0;
};

/// R Sigma R^T: the covariance of a point given in another frame, q' = R q + c.
Eigen::Matrix3d rotateCovariance(const Eigen::Matrix3d& R,
                                 const Eigen::Matrix3d& Sigma);

/// Covariance with standard deviation sigma_range_m along the ray to q and
/// sigma_lateral_m in both directions across it, m.
/// \param q any point but the origin.
Eigen::Matrix3d rayCovariance(const Eigen::Vector3d& q,
                              double sigma_range_m,
                              double sigma_lateral_m);

} // namespace holdfast
