#include <holdfast/sensor/dryanovski_noise_model.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

bool
isValid(const Eigen::Vector3d& q)
{
  return q.allFinite() && q.z() > 0.0;
}

/// Mixture over the window around pixel (u, v), which must be valid.
Eigen::Matrix3d
windowCovariance(const std::vector<Eigen::Vector3d>& points,
                 int width,
                 int height,
                 int u,
                 int v,
                 const NoiseModel& base)
{
  const auto at = [&](int column, int row) -> const Eigen::Vector3d& {
    return points[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(column)];
  };
  const Eigen::Vector3d ray = at(u, v) / at(u, v).z();
  double total = 0.0, mean = 0.0, spread = 0.0;
  Eigen::Matrix3d within = Eigen::Matrix3d::Zero();
  for (int row = std::max(v - 1, 0); row <= std::min(v + 1, height - 1); ++row) {
    for (int column = std::max(u - 1, 0); column <= std::min(u + 1, width - 1);
         ++column) {
      if (!isValid(at(column, row)))
        continue;
      // (1 2 1) x (1 2 1) / 16; the sum is divided out below.
      const double weight = (row == v ? 2.0 : 1.0) * (column == u ? 2.0 : 1.0);
      const double z = at(column, row).z();
      // Mean and spread by West's update, which loses no digits to cancellation.
      total += weight;
      const double step = z - mean;
      mean += step * weight / total;
      spread += weight * step * (z - mean);
      within += weight * base.covariance(ray * z);
    }
  }
  return within / total + spread / total * ray * ray.transpose();
}

} // namespace

std::vector<Eigen::Matrix3f>
mixtureCovariances(const std::vector<Eigen::Vector3d>& points,
                   int width,
                   int height,
                   const NoiseModel& base)
{
  if (width < 0 || height < 0 ||
      points.size() !=
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("mixtureCovariances: not width * height points");
  std::vector<Eigen::Matrix3f> result(
      points.size(),
      Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  std::size_t i = 0;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u, ++i)
      if (isValid(points[i]))
        result[i] = windowCovariance(points, width, height, u, v, base).cast<float>();
  return result;
}

DryanovskiNoiseModel::DryanovskiNoiseModel(NoiseModel::ConstPtr base)
: base_(std::move(base))
{
  if (!base_)
    throw std::invalid_argument("DryanovskiNoiseModel: no base model");
}

Eigen::Matrix3d
DryanovskiNoiseModel::covariance(const Eigen::Vector3d& q) const
{
  return base_->covariance(q);
}

void
DryanovskiNoiseModel::covariances(int n,
                                  const double* x,
                                  const double* y,
                                  const double* z,
                                  const CovarianceChannels& out) const
{
  base_->covariances(n, x, y, z, out);
}

std::vector<Eigen::Matrix3f>
DryanovskiNoiseModel::imageCovariances(const std::vector<Eigen::Vector3d>& points,
                                       int width,
                                       int height) const
{
  return mixtureCovariances(points, width, height, *base_);
}

std::string
DryanovskiNoiseModel::name() const
{
  return "dryanovski";
}

} // namespace holdfast
