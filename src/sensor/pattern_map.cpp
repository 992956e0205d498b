#include <holdfast/sensor/pattern_map.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace holdfast {

PatternMap::PatternMap(int width, int height, std::vector<float> errors_px)
: width_(width), height_(height), errors_(std::move(errors_px))
{
  if (width < 1 || height < 1 ||
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) !=
          errors_.size())
    throw std::invalid_argument("a pattern map wants one error per pixel");
  if (std::any_of(errors_.begin(), errors_.end(), [](float e) {
        return std::isinf(e);
      }))
    throw std::invalid_argument("an error of the pattern map is infinite");
}

Eigen::Vector3d
withoutDisparityError(const Eigen::Vector3d& q,
                      double error_px,
                      double focal_times_baseline)
{
  // d / (d - error) with d = f b / z.
  const double rest = 1.0 - error_px * q.z() / focal_times_baseline;
  if (!(rest > 0.0))
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return q / rest;
}

} // namespace holdfast
