#include <holdfast/pcl/intrinsics.h>

#include "view_check.h"

#include <pcl/common/point_tests.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace holdfast {

namespace {

constexpr double kMaxFitResidualPx = 1.0;
constexpr double kMaxCameraResidualPx = 2.0;
/// Of cameras of one type.
constexpr double kTypeTolerance = 0.05;
/// "Nearly all" points.
constexpr double kShareInFront = 0.99;
/// Every n-th row and column is enough, unless that leaves too few points. A prime that
/// is in no camera's ratio of sides: in a cloud whose width and height are exchanged,
/// every fourth row of 4:3 begins where a true row does.
constexpr int kSparseStep = 7;
constexpr int kEnoughPoints = 1000;

/// Calls use(u, v, x/z, y/z) for every step-th pixel whose point is in front of the
/// camera.
template <typename Use>
void
forEachRay(const RangeCloud& cloud, int step, Use&& use)
{
  const Pose to_camera = cloud.sensor_pose.inverse();
  const int width = static_cast<int>(cloud.points->width);
  const int height = static_cast<int>(cloud.points->height);
  for (int v = 0; v < height; v += step)
    for (int u = 0; u < width; u += step) {
      const pcl::PointXYZ& p = (*cloud.points)(u, v);
      if (!pcl::isFinite(p))
        continue;
      const Eigen::Vector3d q = to_camera.toWorld(p.getVector3fMap().cast<double>());
      if (q.z() > 0.0)
        use(u, v, q.x() / q.z(), q.y() / q.z());
    }
}

/// Straight line pixel = focal * slope + centre through all points, by least squares.
class LineFit {
public:
  void add(double slope, double pixel)
  {
    const double ds = slope - mean_slope_;
    const double dp = pixel - mean_pixel_;
    ++n_;
    mean_slope_ += ds / n_;
    mean_pixel_ += dp / n_;
    slope_slope_ += ds * (slope - mean_slope_);
    slope_pixel_ += ds * (pixel - mean_pixel_);
    pixel_pixel_ += dp * (pixel - mean_pixel_);
  }

  int count() const
  {
    return n_;
  }
  double focal() const
  {
    return slope_pixel_ / slope_slope_;
  }
  double centre() const
  {
    return mean_pixel_ - focal() * mean_slope_;
  }
  /// Sum of squared residuals, px^2.
  double residual() const
  {
    return std::max(0.0, pixel_pixel_ - focal() * slope_pixel_);
  }
  /// False when all pixels, or all slopes, are the same.
  bool isDetermined() const
  {
    return n_ > 2 && pixel_pixel_ > 0.0 && slope_slope_ > 0.0;
  }

private:
  int n_ = 0;
  double mean_slope_ = 0.0, mean_pixel_ = 0.0;
  double slope_slope_ = 0.0, slope_pixel_ = 0.0, pixel_pixel_ = 0.0;
};

struct PinholeFit {
  LineFit columns, rows;
};

PinholeFit
fitPinhole(const RangeCloud& cloud)
{
  PinholeFit fit;
  for (const int step : {kSparseStep, 1}) {
    fit = {};
    forEachRay(cloud, step, [&fit](int u, int v, double x_z, double y_z) {
      fit.columns.add(x_z, u);
      fit.rows.add(y_z, v);
    });
    if (fit.columns.count() >= kEnoughPoints)
      break;
  }
  return fit;
}

bool
isOrganized(const RangeCloud& cloud)
{
  return cloud.points->height > 1 && cloud.points->width > 1;
}

double
shareInFront(const RangeCloud& cloud)
{
  const Eigen::Vector3d axis = cloud.sensor_pose.R.col(2);
  std::size_t valid = 0;
  std::size_t in_front = 0;
  for (const pcl::PointXYZ& p : *cloud.points) {
    if (!pcl::isFinite(p))
      continue;
    ++valid;
    const Eigen::Vector3d q = p.getVector3fMap().cast<double>();
    in_front += axis.dot(q - cloud.sensor_pose.c) > 0.0;
  }
  return valid == 0 ? 0.0 : static_cast<double>(in_front) / static_cast<double>(valid);
}

bool
isTakenFrom(const RangeCloud& cloud)
{
  return shareInFront(cloud) >= kShareInFront &&
         (!isOrganized(cloud) || recoverIntrinsics(cloud));
}

std::string
describeChange(const Camera& from, const Camera& to)
{
  return fmt::format("intrinsics recovered from the cloud: fx {:.1f} fy {:.1f} cx "
                     "{:.1f} cy {:.1f}, where the sensor has {:.1f} {:.1f} {:.1f} "
                     "{:.1f}",
                     to.fx,
                     to.fy,
                     to.cx,
                     to.cy,
                     from.fx,
                     from.fy,
                     from.cx,
                     from.cy);
}

} // namespace

std::optional<double>
pixelResidual(const RangeCloud& cloud, const Camera& camera)
{
  if (!isOrganized(cloud))
    return std::nullopt;
  int n = 0;
  double sum = 0.0;
  for (const int step : {kSparseStep, 1}) {
    n = 0;
    sum = 0.0;
    forEachRay(cloud, step, [&](int u, int v, double x_z, double y_z) {
      ++n;
      const double du = camera.fx * x_z + camera.cx - u;
      const double dv = camera.fy * y_z + camera.cy - v;
      sum += du * du + dv * dv;
    });
    if (n >= kEnoughPoints)
      break;
  }
  if (n == 0)
    return std::nullopt;
  return std::sqrt(sum / n);
}

std::optional<Camera>
recoverIntrinsics(const RangeCloud& cloud, double* rms_px)
{
  if (!isOrganized(cloud))
    return std::nullopt;
  const PinholeFit fit = fitPinhole(cloud);
  if (!fit.columns.isDetermined() || !fit.rows.isDetermined())
    return std::nullopt;
  const double rms =
      std::sqrt((fit.columns.residual() + fit.rows.residual()) / fit.columns.count());
  // A mirrored image has a negative focal length: not the camera frame of this library.
  const bool good =
      rms <= kMaxFitResidualPx && fit.columns.focal() > 0.0 && fit.rows.focal() > 0.0;
  if (!good)
    return std::nullopt;
  if (rms_px != nullptr)
    *rms_px = rms;
  Camera camera;
  camera.width = static_cast<int>(cloud.points->width);
  camera.height = static_cast<int>(cloud.points->height);
  camera.fx = fit.columns.focal();
  camera.fy = fit.rows.focal();
  camera.cx = fit.columns.centre();
  camera.cy = fit.rows.centre();
  return camera;
}

bool
isOfType(const Camera& recovered, const Camera& camera)
{
  const auto near = [](double a, double b, double scale) {
    return std::abs(a - b) <= kTypeTolerance * scale;
  };
  return recovered.width == camera.width && recovered.height == camera.height &&
         near(recovered.fx, camera.fx, camera.fx) &&
         near(recovered.fy, camera.fy, camera.fy) &&
         near(recovered.cx, camera.cx, camera.width) &&
         near(recovered.cy, camera.cy, camera.height);
}

Pose
chooseSensorPose(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& points,
                 const Pose& file_pose,
                 std::string* notice)
{
  const bool has_position = !file_pose.c.isZero(0.0);
  if (has_position || isIdentity(file_pose) || isTakenFrom({points, {}, file_pose}) ||
      !isTakenFrom({points, {}, Pose{}}))
    return file_pose;
  if (notice != nullptr)
    *notice = "the points are in the camera frame: the sensor's orientation in the "
              "file, which contradicts them, is not used";
  return Pose{};
}

bool
mayBeSeenBy(const RangeCloud& cloud, const Sensor& sensor)
{
  return (sensor.noise && sensor.noise->isOmnidirectional()) ||
         !ViewCheck(cloud, sensor).isForeign();
}

Sensor
matchedSensor(const Sensor& sensor, const RangeCloud& cloud, std::string* notice)
{
  const std::optional<double> residual = pixelResidual(cloud, sensor.camera);
  if (!residual || *residual <= kMaxCameraResidualPx)
    return sensor;
  const std::optional<Camera> recovered = recoverIntrinsics(cloud);
  if (!recovered)
    return sensor;
  if (notice != nullptr)
    *notice = describeChange(sensor.camera, *recovered);
  return withCamera(sensor, *recovered);
}

} // namespace holdfast
