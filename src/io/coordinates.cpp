/// Coordinates on their way from double to float.
#include "cloud_readers.h"

#include <algorithm>
#include <cmath>

namespace holdfast::io {
namespace {

bool
isUsable(const double* q)
{
  const bool finite = std::isfinite(q[0]) && std::isfinite(q[1]) && std::isfinite(q[2]);
  // Zeros stand for no return; they have not been moved along.
  return finite && (q[0] != 0.0 || q[1] != 0.0 || q[2] != 0.0);
}

/// True when rounding to float would move some coordinate by what matters.
bool
losesDigits(const std::vector<double>& xyz)
{
  constexpr double kCoarsestStep = 1e-5; // m
  double largest = 0.0;
  double error = 0.0;
  for (std::size_t i = 0; i < xyz.size(); i += 3) {
    if (!isUsable(&xyz[i]))
      continue;
    for (std::size_t k = i; k < i + 3; ++k) {
      largest = std::max(largest, std::abs(xyz[k]));
      error =
          std::max(error,
                   std::abs(xyz[k] - static_cast<double>(static_cast<float>(xyz[k]))));
    }
  }
  const double step = std::ldexp(largest, -23);
  // Text of single precision has nine digits at most: nothing to lose.
  return step > kCoarsestStep && error > step / 64.0;
}

/// Of values that are put into another order.
double
quantile(std::vector<double>& values, double share)
{
  const auto rank =
      static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

} // namespace

Eigen::Vector3d
offsetOf(const std::vector<double>& xyz)
{
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  if (!losesDigits(xyz))
    return none;
  // Medians: single points far away do not move them.
  Eigen::Vector3d middle = none;
  // Of the coordinate that varies most, for three quarters of the points.
  double spread = 0.0;
  std::vector<double> values;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t i = 0; i < xyz.size(); i += 3)
      if (isUsable(&xyz[i]))
        values.push_back(xyz[i + static_cast<std::size_t>(axis)]);
    middle[axis] = quantile(values, 0.5);
    for (double& value : values)
      value = std::abs(value - middle[axis]);
    spread = std::max(spread, quantile(values, 0.75));
  }
  // Points about the origin gain nothing, and it may be where the sensor stood.
  constexpr double kGain = 8.0; // three bits
  const bool is_far = middle.lpNorm<Eigen::Infinity>() > kGain * spread;
  return is_far ? Eigen::Vector3d(middle.array().round()) : none;
}

void
placePoints(const std::vector<double>& xyz, RawCloud& cloud)
{
  cloud.offset = offsetOf(xyz);
  const bool is_shifted = !cloud.offset.isZero(0.0);
  auto& points = *cloud.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double* q = &xyz[3 * i];
    if (is_shifted && !isUsable(q)) {
      // Shifted, a zero would not be recognised any more.
      cloud.info.zero_points += q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0;
      points[i].getVector3fMap().setConstant(std::numeric_limits<float>::quiet_NaN());
      continue;
    }
    for (int k = 0; k < 3; ++k)
      points[i].data[k] = static_cast<float>(q[k] - cloud.offset[k]);
  }
}

} // namespace holdfast::io
