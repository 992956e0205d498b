#include <holdfast/patch/surface.h>
#include <holdfast/validation/residual.h>

#include "local_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast {
namespace {

// The surface q^T K q - 2 z = 0 in its own frame, K = diag(k).
struct LocalSurface {
  explicit LocalSurface(const Patch& patch)
  : k(implicitDiagonal(patch)), is_paraboloid(isParaboloid(patch.type.surface))
  {}

  double value(const Eigen::Vector3d& q) const
  {
    return q.dot(k.cwiseProduct(q)) - 2.0 * q.z();
  }

  Eigen::Vector3d halfGradient(const Eigen::Vector3d& q) const
  {
    return k.cwiseProduct(q) - Eigen::Vector3d::UnitZ();
  }

  Eigen::Vector3d k;
  bool is_paraboloid;
};

// Plane, sphere and cylinder: with h half the gradient, |h| is the distance from the
// centre or axis over the radius, and f = (|h|^2 - 1)/k; the quotient is free of
// cancellation, and of 1/k where k goes to zero.
double
roundDistance(const LocalSurface& surface, const Eigen::Vector3d& q)
{
  return -surface.value(q) / (1.0 + surface.halfGradient(q).norm());
}

// The smaller root t of f(q - t h) = f - 2 t h^2 + t^2 h^T K h, h half the gradient;
// the extremum where there is none.
double
rootAlongGradient(const LocalSurface& surface, const Eigen::Vector3d& q)
{
  const Eigen::Vector3d h = surface.halfGradient(q);
  const double hh = h.squaredNorm();
  const double f = surface.value(q);
  const double squared = hh * hh - f * h.dot(surface.k.cwiseProduct(h));
  return f / (hh + std::sqrt(std::max(squared, 0.0)));
}

// The foot of q on a paraboloid is p = ((1 + t K)^-1 q)_xy, p_z = q_z + t, with the
// multiplier t that solves
//
//     g(t) = sum_xy k p^2 - 2 (q_z + t) = 0.
//
// Among several solutions the one with 1 + t k >= 0 on both axes is the nearest point
// of all (there the Lagrangian is convex), and between these poles g falls with a slope
// of -2 or steeper: the root lies between 0 and g(0)/2, or at a pole, -1/k.
class FootSolver {
public:
  FootSolver(const LocalSurface& surface, const Eigen::Vector3d& q)
  : k_(surface.k.head<2>()), q_(q)
  {
    const double reach = 0.5 * surface.value(q);
    setBracket(0.0, reach);
    const double k_pole = reach < 0.0 ? k_.maxCoeff(&steep_) : k_.minCoeff(&steep_);
    const double halfway = -0.5 / k_pole;
    if (!(reach * k_pole < 0.0 && std::abs(reach) > std::abs(halfway)))
      return;
    setBracket(0.0, halfway);
    if (evaluate(halfway).g * reach <= 0.0)
      return;
    // Beyond the half the unknown is the distance from the pole, where 1 + t k would
    // lose its digits.
    is_near_pole_ = true;
    base_ = -1.0 / k_pole;
    margin_at_base_ = 1.0 - k_ / k_pole;
    setBracket(0.0, halfway - base_);
  }

  // \param start guess of t.
  Eigen::Vector3d solve(double start)
  {
    double s = std::clamp(start - base_, low_, high_);
    for (int i = 0; i < kMostSteps; ++i) {
      const double step = improve(s);
      s += step;
      // Newton's error is below 3/2 k step^2 / (1 + t k).
      if ((k_ * step).abs().maxCoeff() <= kQuadratic * margins(s).minCoeff())
        break;
    }
    return foot(s);
  }

private:
  static constexpr int kMostSteps = 100; // halvings reach a double's resolution by then
  static constexpr double kQuadratic = 1e-8; // its square is rounding

  struct Value {
    double g;
    double slope;
  };

  void setBracket(double a, double b)
  {
    low_ = std::min(a, b);
    high_ = std::max(a, b);
  }

  // 1 + t k at t = base + s. At a pole, 0/margin must be 0.
  Eigen::Array2d margins(double s) const
  {
    return (margin_at_base_ + s * k_).max(std::numeric_limits<double>::min());
  }

  Value evaluate(double s) const
  {
    const Eigen::Array2d margin = margins(s);
    const Eigen::Array2d p = q_.head<2>().array() / margin;
    const Eigen::Array2d kpp = k_ * p * p;
    return {kpp.sum() - 2.0 * (q_.z() + base_ + s),
            -2.0 * (1.0 + (k_ * kpp / margin).sum())};
  }

  // A Newton step, or half the bracket where that leads out of it; narrows the bracket.
  double improve(double s)
  {
    const Value value = evaluate(s);
    (value.g > 0.0 ? low_ : high_) = s;
    const double step = -value.g / value.slope;
    if (s + step >= low_ && s + step <= high_)
      return step;
    return 0.5 * (low_ + high_) - s;
  }

  Eigen::Vector3d foot(double s) const
  {
    Eigen::Vector3d p;
    p << q_.head<2>().array() / margins(s), q_.z() + base_ + s;
    // At the pole its coordinate is 0/0, for a point above the centre of curvature,
    // whose feet form a pair or a ring: it comes from g = 0 instead.
    if (is_near_pole_) {
      const double other = k_[1 - steep_] * p[1 - steep_] * p[1 - steep_];
      const double squared = (2.0 * p.z() - other) / k_[steep_];
      p[steep_] = std::copysign(std::sqrt(std::max(squared, 0.0)), q_[steep_]);
    }
    return p;
  }

  Eigen::Array2d k_;
  Eigen::Vector3d q_;
  bool is_near_pole_ = false;
  int steep_ = 0; // axis of the pole
  double base_ = 0.0;
  Eigen::Array2d margin_at_base_ = Eigen::Array2d::Ones();
  double low_ = 0.0, high_ = 0.0; // of s = t - base
};

Eigen::Vector3d
nearestPoint(const LocalSurface& surface, const Eigen::Vector3d& q)
{
  const double t = rootAlongGradient(surface, q);
  // The half gradient of a paraboloid has z component -1, so a step of t along it lifts
  // the point by t, as the multiplier t does.
  if (surface.is_paraboloid)
    return FootSolver(surface, q).solve(t);
  // From the centre of a sphere or the axis of a cylinder every foot is as near as the
  // one below.
  const Eigen::Vector3d h = surface.halfGradient(q);
  return h.isZero(0.0) ? Eigen::Vector3d(q.x(), q.y(), 0.0) :
                         Eigen::Vector3d(q - t * h);
}

double
exactDistance(const LocalSurface& surface, const Eigen::Vector3d& q)
{
  if (!surface.is_paraboloid)
    return roundDistance(surface, q);
  return std::copysign((q - nearestPoint(surface, q)).norm(), -surface.value(q));
}

double
approximateDistance(const LocalSurface& surface, const Eigen::Vector3d& q)
{
  if (!surface.is_paraboloid)
    return roundDistance(surface, q);
  return -rootAlongGradient(surface, q) * surface.halfGradient(q).norm();
}

} // namespace

double
distanceToSurface(const Patch& patch, const Eigen::Vector3d& point)
{
  return exactDistance(LocalSurface(patch), patch.pose().toLocal(point));
}

std::vector<double>
distancesToSurface(const Patch& patch, const std::vector<Eigen::Vector3d>& points)
{
  const LocalSurface surface(patch);
  const Pose pose = patch.pose();
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector3d& point : points)
    distances.push_back(exactDistance(surface, pose.toLocal(point)));
  return distances;
}

Eigen::Vector3d
nearestSurfacePoint(const Patch& patch, const Eigen::Vector3d& point)
{
  const Pose pose = patch.pose();
  return pose.toWorld(nearestPoint(LocalSurface(patch), pose.toLocal(point)));
}

double
approximateDistanceToSurface(const Patch& patch, const Eigen::Vector3d& point)
{
  return approximateDistance(LocalSurface(patch), patch.pose().toLocal(point));
}

SurfaceResidual
residualOf(const Patch& patch, const LocalPoints& points)
{
  const LocalSurface surface(patch);
  // The approximation is right to a thousandth below this distance: 0.08^2/8/0.92^2.
  const double trusted = 0.08 / surface.k.lpNorm<Eigen::Infinity>();
  const double trusted_square =
      surface.is_paraboloid ? trusted * trusted : std::numeric_limits<double>::max();
  SurfaceResidual residual;
  constexpr double kNoise = kNoiseSigmas * kNoiseSigmas;
  double sum = 0.0, largest = 0.0, unexplained = 0.0;
  for (int i = 0; i < points.size(); ++i) {
    double squared = points.squaredDistance(i);
    if (!(squared <= trusted_square)) {
      const double exact = exactDistance(surface, points[i]);
      squared = exact * exact;
    }
    sum += squared;
    largest = std::max(largest, squared);
    if (squared > kNoise * points.variance(i))
      unexplained = std::max(unexplained, squared);
  }
  residual.points = points.size();
  residual.largest_m = std::sqrt(largest);
  residual.unexplained_m = std::sqrt(unexplained);
  if (residual.points > 0)
    residual.rms_m = std::sqrt(sum / residual.points);
  return residual;
}

SurfaceResidual
measureResidual(const Patch& patch, const PointBatch& points)
{
  return residualOf(patch, LocalPoints(patch, points));
}

SurfaceResidual
measureResidual(const Patch& patch, const std::vector<Eigen::Vector3d>& points)
{
  return residualOf(patch, LocalPoints(patch, points));
}

} // namespace holdfast
