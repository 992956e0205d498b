#include "view.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace holdfast::app {
namespace {

constexpr double kNearest = 1e-3; // m, before a perspective eye

/// The interval without the outer 1 % of the values on each side, which are reordered.
std::pair<double, double>
bulk(std::vector<double>& values)
{
  const auto quantile = [&values](double share) {
    const auto at = values.begin() +
                    std::lround(share * (static_cast<double>(values.size()) - 1.0));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const double low = quantile(0.01);
  return {low, quantile(0.99)};
}

} // namespace

View
View::perspective(const Pose& camera)
{
  return {camera, true};
}

View
View::orthographic(const Eigen::Matrix3d& orientation)
{
  return {{orientation, Eigen::Vector3d::Zero()}, false};
}

View
View::orbit(const Eigen::Vector3d& front,
            const Eigen::Vector3d& up,
            double azimuth,
            double elevation)
{
  const Eigen::Vector3d side = up.cross(front);
  const Eigen::Vector3d out = std::cos(azimuth) * front + std::sin(azimuth) * side;
  Eigen::Matrix3d orientation;
  orientation.col(0) = std::cos(azimuth) * side - std::sin(azimuth) * front;
  orientation.col(2) = -std::cos(elevation) * out - std::sin(elevation) * up;
  orientation.col(1) = orientation.col(2).cross(orientation.col(0));
  return orthographic(orientation);
}

void
View::fit(const std::vector<Eigen::Vector3d>& points, const Frame& frame, double zoom)
{
  constexpr double kMargin = 0.05; // of the frame, on each side
  constexpr double kLeastExtent = 1e-9; // of a single point
  scale_ = 1.0;
  shift_.setZero();
  std::vector<double> x, y;
  for (const Eigen::Vector3d& point : points)
    if (const auto at = project(point)) {
      x.push_back(at->x);
      y.push_back(at->y);
    }
  if (x.empty())
    return;
  const auto [left, right] = bulk(x);
  const auto [top, bottom] = bulk(y);
  scale_ = zoom * (1.0 - 2.0 * kMargin) *
           std::min(frame.width() / std::max(right - left, kLeastExtent),
                    frame.height() / std::max(bottom - top, kLeastExtent));
  const Eigen::Vector2d middle(0.5 * (left + right), 0.5 * (top + bottom));
  shift_ = Eigen::Vector2d(0.5 * (frame.left + frame.right),
                           0.5 * (frame.top + frame.bottom)) -
           scale_ * middle;
}

std::optional<ScreenPoint>
View::project(const Eigen::Vector3d& world) const
{
  const Eigen::Vector3d q = camera_.toLocal(world);
  if (perspective_ && q.z() < kNearest)
    return std::nullopt;
  const double scale = perspective_ ? scale_ / q.z() : scale_;
  return ScreenPoint{scale * q.x() + shift_.x(),
                     scale * q.y() + shift_.y(),
                     nearness(q.z())};
}

Eigen::Vector3d
View::towardsEye(const Eigen::Vector3d& world) const
{
  return perspective_ ? (camera_.c - world).normalized().eval() :
                        (-camera_.R.col(2)).eval();
}

double
View::depth(double nearness) const
{
  return perspective_ ? 1.0 / nearness : -nearness;
}

double
View::nearness(double depth_m) const
{
  return perspective_ ? 1.0 / depth_m : -depth_m;
}

double
View::pixelSize(double depth_m) const
{
  return (perspective_ ? depth_m : 1.0) / scale_;
}

Eigen::Vector3d
View::normal(const ScreenPoint& at, double per_x, double per_y) const
{
  // On the plane n'q = h with q = z (x, y, 1) the nearness is 1/z = n'(x, y, 1) / h, so
  // its slopes are n_x / h and n_y / h. Orthographic: -z = (n_x x + n_y y - h) / n_z.
  const Eigen::Vector2d slope = scale_ * Eigen::Vector2d(per_x, per_y);
  const Eigen::Vector2d xy = (Eigen::Vector2d(at.x, at.y) - shift_) / scale_;
  const Eigen::Vector3d away(slope.x(),
                             slope.y(),
                             perspective_ ? at.nearness - slope.dot(xy) : 1.0);
  return camera_.R * -away.normalized();
}

double
View::brightness(const Eigen::Vector3d& normal) const
{
  const Eigen::Vector3d lamp = Eigen::Vector3d(-0.5, -0.75, -0.75).normalized();
  constexpr double kAmbient = 0.5;
  const Eigen::Vector3d n = camera_.R.transpose() * normal;
  const double facing = n.dot(lamp) * (n.z() > 0.0 ? -1.0 : 1.0);
  return kAmbient + (1.0 - kAmbient) * std::max(0.0, facing);
}

} // namespace holdfast::app
