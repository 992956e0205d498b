#include "pixel_grid.h"

#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast {

namespace {

struct FittedCamera {
  Camera camera;
  double rms_px = 0.0;
};

std::optional<FittedCamera>
cameraOf(const RangeCloud& cloud, const Sensor& sensor)
{
  FittedCamera fitted;
  if (const auto recovered = recoverIntrinsics(cloud, &fitted.rms_px)) {
    fitted.camera = *recovered;
    return fitted;
  }
  const std::optional<double> residual = pixelResidual(cloud, sensor.camera);
  if (!residual || *residual > kMaxResidualPx)
    return std::nullopt;
  fitted.camera = sensor.camera;
  fitted.camera.width = static_cast<int>(cloud.points->width);
  fitted.camera.height = static_cast<int>(cloud.points->height);
  fitted.rms_px = *residual;
  return fitted;
}

std::vector<float>
depthImage(const RangeCloud& cloud)
{
  const Eigen::Vector3f axis = cloud.sensor_pose.R.col(2).cast<float>();
  const Eigen::Vector3f centre = cloud.sensor_pose.c.cast<float>();
  const auto depthOf = [&](const pcl::PointXYZ& p) {
    const float z = pcl::isFinite(p) ? axis.dot(p.getVector3fMap() - centre) : 0.0F;
    return z > 0.0F ? z : std::numeric_limits<float>::quiet_NaN();
  };
  std::vector<float> depth;
  depth.reserve(cloud.points->size() + kRowPadding);
  depth.resize(cloud.points->size());
  std::transform(cloud.points->begin(), cloud.points->end(), depth.begin(), depthOf);
  depth.resize(depth.size() + kRowPadding, std::numeric_limits<float>::quiet_NaN());
  return depth;
}

/// Pixels along one image axis that a ball can touch: x/z of the two tangents through
/// the camera centre, s = (x z -+ r sqrt(x^2 + z^2 - r^2)) / (z^2 - r^2).
PixelRange
tangentRange(double x, double z, double r, double focal, double centre, int size)
{
  if (z <= r)
    return {0, size};
  const double root = r * std::sqrt(x * x + z * z - r * r);
  const double scale = 1.0 / (z * z - r * r);
  const double low = focal * (x * z - root) * scale + centre;
  const double high = focal * (x * z + root) * scale + centre;
  const auto toPixel = [size](double p) {
    return static_cast<int>(std::clamp(p, 0.0, static_cast<double>(size)));
  };
  return {toPixel(std::floor(low)), toPixel(std::floor(high) + 1.0)};
}

PixelRange
widened(const PixelRange& range, double margin, int size)
{
  const int m = static_cast<int>(std::ceil(margin));
  return {std::max(range.begin - m, 0), std::min(range.end + m, size)};
}

} // namespace

PixelWindow
PixelGrid::ballWindow(const Eigen::Vector3d& centre, double radius) const
{
  const PixelRange columns =
      tangentRange(centre.x(), centre.z(), radius, camera.fx, camera.cx, camera.width);
  const PixelRange rows =
      tangentRange(centre.y(), centre.z(), radius, camera.fy, camera.cy, camera.height);
  return {widened(columns, margin_px, camera.width),
          widened(rows, margin_px, camera.height)};
}

std::optional<PixelGrid>
makePixelGrid(const RangeCloud& cloud, const Sensor& sensor)
{
  const std::optional<FittedCamera> fitted = cameraOf(cloud, sensor);
  if (!fitted)
    return std::nullopt;
  // Five sigmas of Gaussian pixel noise, and one pixel for systematic distortion.
  return PixelGrid{fitted->camera, 1.0 + 5.0 * fitted->rms_px, depthImage(cloud)};
}

} // namespace holdfast
