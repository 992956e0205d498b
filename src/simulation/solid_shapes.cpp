#include <holdfast/simulation/shape.h>

#include "ray.h"
#include "sensor/require.h"

#include <array>

namespace holdfast {

namespace {

/// Real roots of a t^2 + 2 b t + c with a > 0, ascending.
std::optional<std::array<double, 2>>
quadraticRoots(double a, double b, double c)
{
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0)
    return std::nullopt;
  // The root without cancellation first, the other from their product c / a.
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  if (q == 0.0)
    return std::array<double, 2>{0.0, 0.0};
  const double t1 = q / a;
  const double t2 = c / q;
  return std::array<double, 2>{std::min(t1, t2), std::max(t1, t2)};
}

} // namespace

Ball::Ball(const Eigen::Vector3d& center, double radius)
: center_(center), radius_(radius)
{
  requirePositive("radius", radius);
}

std::optional<double>
Ball::intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  const Eigen::Vector3d o = origin - center_;
  const auto roots = quadraticRoots(direction.squaredNorm(),
                                    o.dot(direction),
                                    o.squaredNorm() - radius_ * radius_);
  if (!roots || roots->at(1) < 0.0)
    return std::nullopt;
  return roots->at(0) >= 0.0 ? roots->at(0) : roots->at(1);
}

std::string
Ball::name() const
{
  return "ball";
}

std::vector<ShapeParameter>
Ball::parameters() const
{
  return {{"center", center_}, {"radius", radius_}};
}

Box::Box(const Pose& pose, const Eigen::Vector3d& size) : pose_(pose), size_(size)
{
  for (int axis = 0; axis < 3; ++axis)
    requirePositive("size", size[axis]);
}

std::optional<double>
Box::intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  const auto inside =
      clipToBox(pose_.toLocal(origin), pose_.R.transpose() * direction, 0.5 * size_);
  if (!inside || inside->end < 0.0)
    return std::nullopt;
  return inside->begin >= 0.0 ? inside->begin : inside->end;
}

std::string
Box::name() const
{
  return "box";
}

std::vector<ShapeParameter>
Box::parameters() const
{
  return {{"center", pose_.c},
          {"x_axis", pose_.R.col(0)},
          {"y_axis", pose_.R.col(1)},
          {"size", size_}};
}

Pipe::Pipe(const Eigen::Vector3d& center,
           const Eigen::Vector3d& axis,
           double radius,
           double length)
: center_(center), axis_(axis.normalized()), radius_(radius), length_(length)
{
  requirePositive("axis length", axis.norm());
  requirePositive("radius", radius);
  requirePositive("length", length);
}

std::optional<double>
Pipe::intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  const Eigen::Vector3d o = origin - center_;
  const Eigen::Vector3d o_across = o - o.dot(axis_) * axis_;
  const Eigen::Vector3d d_across = direction - direction.dot(axis_) * axis_;
  const double a = d_across.squaredNorm();
  if (a == 0.0)
    return std::nullopt;
  const auto roots = quadraticRoots(a,
                                    o_across.dot(d_across),
                                    o_across.squaredNorm() - radius_ * radius_);
  if (!roots)
    return std::nullopt;
  for (const double t : *roots)
    if (t >= 0.0 && std::abs((o + t * direction).dot(axis_)) <= 0.5 * length_)
      return t;
  return std::nullopt;
}

std::string
Pipe::name() const
{
  return "pipe";
}

std::vector<ShapeParameter>
Pipe::parameters() const
{
  return {{"center", center_},
          {"axis", axis_},
          {"radius", radius_},
          {"length", length_}};
}

} // namespace holdfast
