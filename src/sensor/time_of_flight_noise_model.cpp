#include <holdfast/sensor/time_of_flight_noise_model.h>

#include "require.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

namespace holdfast {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
/// 80 degrees.
constexpr double kLargestAngle = 8.0 / 9.0 * kHalfPi;
/// The window reaches three steps to each side: 49 pixels of 13 x 13, wide enough for
/// the noise of the angle to stay below that of what it is for.
constexpr int kSteps = 3;
constexpr int kStride = 2;
/// A plane at 80 degrees changes its depth by about this over the window's half width
/// of six pixels of 400; what is further away is another surface.
constexpr double kDepthJump = 0.1;
constexpr int kFewestPoints = 10;

bool
isValid(const Eigen::Vector3d& q)
{
  return q.allFinite() && q.z() > 0.0;
}

struct Image {
  const std::vector<Eigen::Vector3d>& points;
  int width;
  int height;

  bool contains(int u, int v) const
  {
    return u >= 0 && u < width && v >= 0 && v < height;
  }
  const Eigen::Vector3d& at(int u, int v) const
  {
    return points[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(u)];
  }
};

/// Angle between the ray to pixel (u, v), which must be valid, and the normal of the
/// plane n^T q = 1 through the window around it: least squares of the inverse depth,
/// 1/z = n^T (x/z, y/z, 1), which is linear in the pixel on every plane.
double
incidence(const Image& image, int u, int v)
{
  const Eigen::Vector3d& middle = image.at(u, v);
  const Eigen::Vector2d slope = middle.head<2>() / middle.z();
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  int n = 0;
  for (int j = -kSteps; j <= kSteps; ++j)
    for (int i = -kSteps; i <= kSteps; ++i) {
      const int column = u + kStride * i, row = v + kStride * j;
      if (!image.contains(column, row))
        continue;
      const Eigen::Vector3d& q = image.at(column, row);
      if (!isValid(q) || std::abs(q.z() - middle.z()) > kDepthJump * middle.z())
        continue;
      // About the middle pixel, for the digits.
      const Eigen::Vector3d s(q.x() / q.z() - slope.x(), q.y() / q.z() - slope.y(), 1);
      A += s * s.transpose();
      b += s * (middle.z() / q.z());
      ++n;
    }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
  if (n < kFewestPoints || ldlt.info() != Eigen::Success ||
      ldlt.vectorD().minCoeff() <= 1e-12 * ldlt.vectorD().maxCoeff())
    return 0.0;
  const Eigen::Vector3d m = ldlt.solve(b);
  const Eigen::Vector3d normal(m.x(), m.y(), m.z() - m.head<2>().dot(slope));
  const double cosine = std::abs(normal.dot(middle)) / (normal.norm() * middle.norm());
  return std::acos(std::min(1.0, cosine));
}

} // namespace

TimeOfFlightNoiseModel::TimeOfFlightNoiseModel(const Parameters& parameters)
: parameters_(parameters)
{
  requireNotNegative("sigma_m", parameters.sigma_m);
  requireNotNegative("sigma_per_m2", parameters.sigma_per_m2);
  requireNotNegative("best_depth_m", parameters.best_depth_m);
  requireNotNegative("sigma_incidence_m", parameters.sigma_incidence_m);
  requireNotNegative("sigma_point_px", parameters.sigma_point_px);
  requirePositive("focal_px", parameters.focal_px);
}

Eigen::Matrix3d
TimeOfFlightNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  return covariance(q, 0.0);
}

Eigen::Matrix3d
TimeOfFlightNoiseModel::covariance(const Eigen::Vector3d& q, double theta_rad) const
{
  const double z = q.z();
  const double theta = std::min(theta_rad, kLargestAngle);
  const double off = z - parameters_.best_depth_m;
  const double steepness = theta / (kHalfPi - theta);
  const double sigma =
      parameters_.sigma_m + parameters_.sigma_per_m2 * off * off +
      parameters_.sigma_incidence_m * z * std::sqrt(z) * steepness * steepness;
  const Eigen::Vector3d along = sigma / z * q;
  const double lateral = parameters_.sigma_point_px * z / parameters_.focal_px;
  Eigen::Matrix3d Sigma = along * along.transpose();
  Sigma(0, 0) += lateral * lateral;
  Sigma(1, 1) += lateral * lateral;
  return Sigma;
}

std::vector<Eigen::Matrix3f>
TimeOfFlightNoiseModel::imageCovariances(const std::vector<Eigen::Vector3d>& points,
                                         int width,
                                         int height) const
{
  if (width < 0 || height < 0 ||
      points.size() !=
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("imageCovariances: not width * height points");
  std::vector<Eigen::Matrix3f> result(
      points.size(),
      Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  const Image image{points, width, height};
  std::size_t i = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u, ++i)
      if (isValid(points[i]))
        result[i] = covariance(points[i], incidence(image, u, v)).cast<float>();
  return result;
}

std::string
TimeOfFlightNoiseModel::name() const
{
  return "time_of_flight";
}

} // namespace holdfast
