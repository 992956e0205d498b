#include "view_check.h"

#include <pcl/common/point_tests.h>

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace holdfast {
namespace {

/// A cloud of which less is seen was not taken by the sensor.
constexpr double kLeastSeen = 0.5;

/// Axes or units explain a cloud that they bring into view as a whole. A few points may
/// always be errors.
constexpr double kExplained = 0.95;

/// Below this share of points in view, a mistake is looked for.
constexpr double kSuspicious = 0.8;

/// Points enough to judge a cloud by.
constexpr std::size_t kSample = 20000;

/// Field of view and range of a sensor, twice as wide and as far as nominal, for wide
/// lenses and long looks.
class Frustum {
public:
  explicit Frustum(const Sensor& sensor)
  : slope_x_(sensor.camera.width / sensor.camera.fx)
  , slope_y_(sensor.camera.height / sensor.camera.fy)
  , max_z_(2.0 * sensor.max_range_m)
  {}

  /// \param q in the camera frame, m.
  bool contains(const Eigen::Vector3d& q) const
  {
    return q.z() > 0.0 && q.z() <= max_z_ && std::abs(q.x()) <= slope_x_ * q.z() &&
           std::abs(q.y()) <= slope_y_ * q.z();
  }

private:
  double slope_x_, slope_y_, max_z_;
};

Eigen::Matrix3d
rows(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z)
{
  Eigen::Matrix3d R;
  R << x.transpose(), y.transpose(), z.transpose();
  return R;
}

} // namespace

/// Another way to read the same numbers.
struct ViewCheck::Frame {
  Eigen::Matrix3d to_camera; ///< from the assumed camera axes to the real ones
  double scale; ///< metres per unit
};

namespace {

struct NamedAxes {
  Eigen::Matrix3d to_camera;
  const char* what; ///< empty: as assumed
};

struct NamedUnit {
  double scale;
  const char* what;
};

const std::array<NamedAxes, 4>&
knownAxes()
{
  using V = Eigen::Vector3d;
  const Eigen::Matrix3d of_opengl = rows(V::UnitX(), -V::UnitY(), -V::UnitZ());
  const Eigen::Matrix3d of_ros = rows(-V::UnitY(), -V::UnitZ(), V::UnitX());
  static const std::array<NamedAxes, 4> axes{
      {{Eigen::Matrix3d::Identity(), ""},
       {of_opengl,
        "the points lie behind the sensor (y up, z back?): --axes opengl turns them, "
        "or is wrong where it was given"},
       {of_ros,
        "the points lie beside and behind the sensor (x forward, z up?): --axes ros "
        "turns them"},
       {of_ros.transpose(),
        "the points lie beside and behind the sensor as --axes ros turns them"}}};
  return axes;
}

constexpr std::array<NamedUnit, 4> kKnownUnits{
    {{1.0, ""},
     {1e-3, "the coordinates look like millimetres: --unit mm scales them"},
     {1e-2, "the coordinates look like centimetres: --unit cm scales them"},
     {1e-6, "the coordinates look like micrometres: --unit um scales them"}}};

} // namespace

ViewCheck::ViewCheck(const RangeCloud& cloud, const Sensor& sensor)
: cloud_(cloud)
, sensor_(sensor)
, share_seen_(shareSeen({Eigen::Matrix3d::Identity(), 1.0}))
{}

double
ViewCheck::shareSeen(const Frame& frame) const
{
  const Frustum frustum(sensor_);
  const Pose to_camera = cloud_.sensor_pose.inverse();
  const std::size_t step = std::max<std::size_t>(1, cloud_.points->size() / kSample);
  std::size_t valid = 0;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < cloud_.points->size(); i += step) {
    const pcl::PointXYZ& p = (*cloud_.points)[i];
    if (!pcl::isFinite(p))
      continue;
    ++valid;
    const Eigen::Vector3d q = to_camera.toWorld(p.getVector3fMap().cast<double>());
    const Eigen::Vector3d as_read = frame.scale * (frame.to_camera * q);
    seen += frustum.contains(as_read) &&
            (frame.scale == 1.0 || as_read.z() >= 0.5 * sensor_.min_range_m);
  }
  return valid == 0 ? 1.0 : static_cast<double>(seen) / static_cast<double>(valid);
}

bool
ViewCheck::isForeign() const
{
  return share_seen_ < kLeastSeen;
}

bool
ViewCheck::isAllAround() const
{
  // The mean direction of a half-space's points is a half; a camera's is near one.
  constexpr double kHalfSpace = 0.5;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t n = 0;
  const std::size_t step = std::max<std::size_t>(1, cloud_.points->size() / kSample);
  for (std::size_t i = 0; i < cloud_.points->size(); i += step) {
    const pcl::PointXYZ& p = (*cloud_.points)[i];
    const Eigen::Vector3d ray =
        p.getVector3fMap().cast<double>() - cloud_.sensor_pose.c;
    if (!pcl::isFinite(p) || ray.squaredNorm() == 0.0)
      continue;
    sum += ray.normalized();
    ++n;
  }
  return n > 0 && sum.norm() < kHalfSpace * static_cast<double>(n);
}

/// Single mistakes before two at once.
std::string
ViewCheck::likelyMistake() const
{
  for (const NamedAxes& axes : knownAxes())
    for (const NamedUnit& unit : kKnownUnits)
      if ((*axes.what == '\0') != (unit.scale == 1.0) &&
          shareSeen({axes.to_camera, unit.scale}) >= kExplained)
        return std::string(axes.what) + unit.what;
  for (const NamedAxes& axes : knownAxes())
    for (const NamedUnit& unit : kKnownUnits)
      if (*axes.what != '\0' && unit.scale != 1.0 &&
          shareSeen({axes.to_camera, unit.scale}) >= kExplained)
        return std::string(axes.what) + "; " + unit.what;
  return {};
}

std::string
ViewCheck::hint() const
{
  return share_seen_ < kSuspicious ? likelyMistake() : std::string();
}

std::string
ViewCheck::foreignNotice() const
{
  const std::string assumed =
      fmt::format("a noise of 1 mm in every direction is assumed{}",
                  sensor_.pattern.empty() ? "" : ", independent from point to point");
  const std::string mistake = likelyMistake();
  if (!mistake.empty())
    return fmt::format("{}; as they are, {}", mistake, assumed);
  return fmt::format("most points lie where the sensor {} cannot see: {}; --sigma, "
                     "another sensor or a covariance field changes that",
                     sensor_.name,
                     assumed);
}

void
ViewCheck::dropUnseen(UnusedPoints& unused) const
{
  const Frustum frustum(sensor_);
  const Pose to_camera = cloud_.sensor_pose.inverse();
  const bool in_camera_frame = isIdentity(cloud_.sensor_pose);
  for (std::size_t i = 0; i < cloud_.points->size(); ++i) {
    const pcl::PointXYZ& p = (*cloud_.points)[i];
    Eigen::Vector3d q = p.getVector3fMap().cast<double>();
    if (!in_camera_frame)
      q = to_camera.toWorld(q);
    // Most points are seen, and those that are not finite are not.
    if (!frustum.contains(q) && pcl::isFinite(p))
      unused.drop(i,
                  q.z() > 0.0 ? &PointAccounting::out_of_view :
                                &PointAccounting::behind_camera);
  }
}

} // namespace holdfast
