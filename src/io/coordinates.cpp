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

} // namespace

Eigen::Vector3d
offsetOf(const std::vector<double>& xyz)
{
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  if (!losesDigits(xyz))
    return offset;
  std::vector<double> values;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t i = 0; i < xyz.size(); i += 3)
      if (isUsable(&xyz[i]))
        values.push_back(xyz[i + static_cast<std::size_t>(axis)]);
    // The median: single points far away do not move it.
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    offset[axis] = std::round(*middle);
  }
  return offset;
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
