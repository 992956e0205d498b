#include <holdfast/simulation/relief.h>

#include "sensor/require.h"

#include <cmath>
#include <stdexcept>

namespace holdfast {

Relief::Relief(const Pose& pose,
               const Eigen::Vector3d& second,
               const Eigen::Vector4d& third,
               double radius)
: pose_(pose), second_(second), third_(third), radius_(radius)
{
  requirePositive("radius", radius);
  if (!second.allFinite() || !third.allFinite())
    throw std::invalid_argument("the derivatives of a relief must be finite");
}

double
Relief::heightAt(double x, double y) const
{
  return 0.5 * (second_[0] * x * x + 2.0 * second_[1] * x * y + second_[2] * y * y) +
         (third_[0] * x * x * x + 3.0 * third_[1] * x * x * y +
          3.0 * third_[2] * x * y * y + third_[3] * y * y * y) /
             6.0;
}

Eigen::Vector2d
Relief::slopeAt(double x, double y) const
{
  return {second_[0] * x + second_[1] * y +
              0.5 * (third_[0] * x * x + 2.0 * third_[1] * x * y + third_[2] * y * y),
          second_[1] * x + second_[2] * y +
              0.5 * (third_[1] * x * x + 2.0 * third_[2] * x * y + third_[3] * y * y)};
}

std::optional<double>
Relief::intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  // Newton's steps from where the ray meets the plane; a ray that is less steep than
  // the surface may meet it twice, or not at all, and counts as missing it.
  constexpr int kMostSteps = 30;
  const Eigen::Vector3d o = pose_.toLocal(origin);
  const Eigen::Vector3d d = pose_.R.transpose() * direction;
  if (!(std::abs(d.z()) > 0.0))
    return std::nullopt;
  double t = -o.z() / d.z();
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::Vector3d p = o + t * d;
    const double slope = slopeAt(p.x(), p.y()).dot(d.head<2>()) - d.z();
    const double change = (heightAt(p.x(), p.y()) - p.z()) / slope;
    if (!std::isfinite(change))
      return std::nullopt;
    t -= change;
    if (std::abs(change) * d.norm() <= 1e-15 * (o.norm() + radius_)) {
      const Eigen::Vector3d end = o + t * d;
      const bool inside = end.head<2>().norm() <= radius_ && t >= 0.0;
      return inside ? std::optional<double>(t) : std::nullopt;
    }
  }
  return std::nullopt;
}

std::string
Relief::name() const
{
  return "relief";
}

std::vector<ShapeParameter>
Relief::parameters() const
{
  return {{"center", pose_.c},
          {"normal", Eigen::Vector3d(pose_.R.col(2))},
          {"second", second_},
          {"third_x", Eigen::Vector3d(third_.head<3>())},
          {"third_yyy", third_[3]},
          {"radius", radius_}};
}

} // namespace holdfast
