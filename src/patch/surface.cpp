#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace holdfast {
namespace {

// Share of the squared radius by which a point on the equator may lie outside it by
// rounding.
constexpr double kEquatorTolerance = 1e-12;

// Square of the height above the equatorial plane, in radii, on the sheet through the
// centre: 1 at the centre, 0 at the equator, negative beyond.
double
squaredElevation(const Patch& patch, double x, double y)
{
  const bool straight = traitsOf(patch.type.surface).along_x == kStraight;
  const double across = straight ? y : std::hypot(x, y);
  const double ratio = patch.kappa.x() * across;
  return 1.0 - ratio * ratio;
}

Eigen::Vector3d
localGradient(const Eigen::Vector3d& K, const Eigen::Vector3d& q)
{
  return 2.0 * (K.cwiseProduct(q) - Eigen::Vector3d::UnitZ());
}

// Real roots of a t^2 + 2 b t + c, ascending; infinity in place of a missing one.
std::array<double, 2>
quadraticRoots(double a, double b, double c)
{
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0.0))
    return {kNone, kNone};
  // The root of larger magnitude has no cancellation; the other follows from the
  // product of both, which also covers a = 0.
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  if (q == 0.0)
    return {a == 0.0 ? kNone : 0.0, kNone};
  const double first = c / q;
  const double second = a == 0.0 ? kNone : q / a;
  return {std::min(first, second), std::max(first, second)};
}

// True when the local point of the unbounded surface belongs to the bounded patch.
bool
isOnPatch(const Patch& patch, const Eigen::Vector3d& local)
{
  // On the sheet through the centre the local normal has no component against z.
  if (traitsOf(patch.type.surface).is_round &&
      patch.kappa.x() * local.z() > 1.0 + kEquatorTolerance)
    return false;
  return contains(patch, local.head<2>());
}

} // namespace

Eigen::Vector3d
implicitDiagonal(const Patch& patch)
{
  const Eigen::Vector2d k = patch.principalCurvatures();
  return {k.x(), k.y(), traitsOf(patch.type.surface).is_round ? patch.kappa.x() : 0.0};
}

double
implicitValue(const Patch& patch, const Eigen::Vector3d& world)
{
  const Eigen::Vector3d q = patch.pose().toLocal(world);
  return q.dot(implicitDiagonal(patch).cwiseProduct(q)) - 2.0 * q.z();
}

Eigen::Vector3d
implicitGradient(const Patch& patch, const Eigen::Vector3d& world)
{
  const Pose pose = patch.pose();
  return pose.R * localGradient(implicitDiagonal(patch), pose.toLocal(world));
}

std::optional<double>
height(const Patch& patch, double x, double y)
{
  const Eigen::Vector2d k = patch.principalCurvatures();
  const double parabola = k.x() * x * x + k.y() * y * y;
  if (!traitsOf(patch.type.surface).is_round)
    return 0.5 * parabola;
  const double squared = squaredElevation(patch, x, y);
  if (squared < -kEquatorTolerance)
    return std::nullopt;
  // The root of k z^2 - 2 z + parabola that stays finite as k goes to 0.
  return parabola / (1.0 + std::sqrt(std::max(squared, 0.0)));
}

std::optional<Eigen::Vector3d>
normalAt(const Patch& patch, double x, double y)
{
  const std::optional<double> z = height(patch, x, y);
  if (!z)
    return std::nullopt;
  const Eigen::Vector3d gradient = localGradient(implicitDiagonal(patch), {x, y, *z});
  return patch.pose().R * -gradient.normalized();
}

std::optional<double>
intersectRay(const Patch& patch,
             const Eigen::Vector3d& origin,
             const Eigen::Vector3d& direction)
{
  const Pose pose = patch.pose();
  const Eigen::Vector3d o = pose.toLocal(origin);
  const Eigen::Vector3d d = pose.R.transpose() * direction;
  const Eigen::Vector3d K = implicitDiagonal(patch);
  // f(o + t d) = a t^2 + 2 b t + c with f of paper eq. (1).
  const double a = d.dot(K.cwiseProduct(d));
  const double b = o.dot(K.cwiseProduct(d)) - d.z();
  const double c = o.dot(K.cwiseProduct(o)) - 2.0 * o.z();
  for (const double t : quadraticRoots(a, b, c))
    if (t >= 0.0 && std::isfinite(t) && isOnPatch(patch, o + t * d))
      return t;
  return std::nullopt;
}

} // namespace holdfast
