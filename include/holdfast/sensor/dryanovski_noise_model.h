/// \file A Gaussian mixture over the neighbouring pixels' depths.
#pragma once

#include <holdfast/sensor/noise_model.h>

namespace holdfast {

/// Covariances of an organized image by the mixture of Dryanovski, Valenti and Xiao,
/// "Fast visual odometry and mapping from RGB-D data", ICRA 2013: since the pointing is
/// uncertain by about a pixel, the depth of each neighbour in the 3x3 window is a
/// hypothesis for the depth of the middle pixel, with weights w = (1 2 1; 2 4 2; 1 2 1)
/// / 16. With depths z_i and variances s_i^2 of the base model the mixture has
///
///   mean = sum w_i z_i,  variance = sum w_i s_i^2 + sum w_i (z_i - mean)^2.
///
/// All six entries: the hypotheses are the points q_i = q z_i / z on the middle pixel's
/// ray, and the result is their total covariance,
/// sum w_i Sigma_base(q_i) + sum w_i (q_i - mean q) (q_i - mean q)^T. It is large at
/// depth discontinuities and on steep surfaces. Invalid neighbours are skipped and the
/// weights of the others normalised. The points themselves are not moved to the mean.
///
/// \param points width * height points, row by row, camera frame; invalid: NaN or
/// z <= 0.
/// \return one matrix per pixel, m^2; NaN where the point is invalid.
/// \throw std::invalid_argument when the number of points is not width * height.
std::vector<Eigen::Matrix3f> mixtureCovariances(
    const std::vector<Eigen::Vector3d>& points,
    int width,
    int height,
    const NoiseModel& base);

/// The mixture as a noise model: imageCovariances() is mixtureCovariances(), and a
/// single point, which has no window, has the covariance of the base model.
class DryanovskiNoiseModel : public NoiseModel {
public:
  /// \param base may not be null; the authors take KhoshelhamNoiseModel.
  /// \throw std::invalid_argument when it is.
  explicit DryanovskiNoiseModel(NoiseModel::ConstPtr base);

  Eigen::Matrix3d covariance(const Eigen::Vector3d& q) const override;
  void covariances(int n,
                   const double* x,
                   const double* y,
                   const double* z,
                   const CovarianceChannels& out) const override;
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
  NoiseModel::ConstPtr base_;
};

} // namespace holdfast
