#include "point_gatherer.h"

#include <holdfast/fit/reference_points.h>

#include <limits>
#include <utility>

namespace holdfast {

namespace {

constexpr double kNoCovariance = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d
position(const RangeCloud& cloud, std::size_t index)
{
  return (*cloud.points)[index].getVector3fMap().cast<double>();
}

/// Models in which a pixel's noise depends on its neighbours look at the whole image.
std::vector<Eigen::Matrix3f>
imageCovariances(const RangeCloud& cloud, const NoiseModel& noise)
{
  const bool organized = cloud.points->height > 1;
  if (cloud.hasCovariances() || !organized || !noise.dependsOnNeighbors())
    return {};
  std::vector<Eigen::Vector3d> image;
  image.reserve(cloud.points->size());
  for (std::size_t i = 0; i < cloud.points->size(); ++i)
    image.push_back(cloud.sensor_pose.toLocal(position(cloud, i)));
  std::vector<Eigen::Matrix3f> covariances =
      noise.imageCovariances(image,
                             static_cast<int>(cloud.points->width),
                             static_cast<int>(cloud.points->height));
  const Eigen::Matrix3f R = cloud.sensor_pose.R.cast<float>();
  for (Eigen::Matrix3f& S : covariances)
    S = (R * S * R.transpose()).eval();
  return covariances;
}

CovarianceChannels
covarianceChannels(PointBatch& batch)
{
  return {batch.channel(PointBatch::SXX),
          batch.channel(PointBatch::SXY),
          batch.channel(PointBatch::SXZ),
          batch.channel(PointBatch::SYY),
          batch.channel(PointBatch::SYZ),
          batch.channel(PointBatch::SZZ)};
}

/// Sigma <- R Sigma R^T for n points, in loops over channels.
void
rotate(const Eigen::Matrix3d& R, int n, const CovarianceChannels& s)
{
  const double r[3][3] = {{R(0, 0), R(0, 1), R(0, 2)},
                          {R(1, 0), R(1, 1), R(1, 2)},
                          {R(2, 0), R(2, 1), R(2, 2)}};
  for (int i = 0; i < n; ++i) {
    const double xx = s.xx[i], xy = s.xy[i], xz = s.xz[i];
    const double yy = s.yy[i], yz = s.yz[i], zz = s.zz[i];
    double a[3][3]; // R Sigma
    for (int j = 0; j < 3; ++j) {
      a[j][0] = r[j][0] * xx + r[j][1] * xy + r[j][2] * xz;
      a[j][1] = r[j][0] * xy + r[j][1] * yy + r[j][2] * yz;
      a[j][2] = r[j][0] * xz + r[j][1] * yz + r[j][2] * zz;
    }
    const auto entry = [&](int j, int k) {
      return a[j][0] * r[k][0] + a[j][1] * r[k][1] + a[j][2] * r[k][2];
    };
    s.xx[i] = entry(0, 0);
    s.xy[i] = entry(0, 1);
    s.xz[i] = entry(0, 2);
    s.yy[i] = entry(1, 1);
    s.yz[i] = entry(1, 2);
    s.zz[i] = entry(2, 2);
  }
}

} // namespace

PointGatherer::PointGatherer(const RangeCloud& cloud,
                             NoiseModel::ConstPtr noise,
                             bool noise_at_surface)
: cloud_(cloud)
, noise_(std::move(noise))
, noise_at_surface_(noise_at_surface)
, to_camera_(cloud.sensor_pose.inverse())
, in_camera_frame_(isIdentity(cloud.sensor_pose))
, image_covariances_(imageCovariances(cloud, *noise_))
, stored_(cloud.hasCovariances() ? *cloud.covariances : image_covariances_)
{}

PointGatherer::PointGatherer(const RangeCloud& cloud,
                             const Sensor& sensor,
                             bool noise_at_surface)
: PointGatherer(cloud, sensor.noise, noise_at_surface)
{
  camera_ = sensor.camera;
  if (!sensor.pattern.empty() && !cloud.hasCovariances())
    pattern_ = std::make_shared<const CorrelatedNoise>(sensor.pattern);
}

void
PointGatherer::gather(const std::vector<int>& indices,
                      const Eigen::Vector3d& origin,
                      PointBatch& batch) const
{
  const int n = static_cast<int>(indices.size());
  batch.clear(origin, cloud_.sensor_pose.c);
  batch.resize(n);
  if (stored_.empty())
    gatherModelled(indices, batch);
  else
    gatherStored(indices, batch);
  if (pattern_)
    sharePattern(batch);
  double* x = batch.channel(PointBatch::X);
  double* y = batch.channel(PointBatch::Y);
  double* z = batch.channel(PointBatch::Z);
  for (int i = 0; i < n; ++i) {
    const pcl::PointXYZ& p = (*cloud_.points)[indices[i]];
    x[i] = p.x - origin.x();
    y[i] = p.y - origin.y();
    z[i] = p.z - origin.z();
  }
}

void
PointGatherer::gatherStored(const std::vector<int>& indices, PointBatch& batch) const
{
  if (pattern_)
    copyToCameraFrame(indices, batch);
  const CovarianceChannels s = covarianceChannels(batch);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Eigen::Matrix3f& S = stored_[static_cast<std::size_t>(indices[i])];
    s.xx[i] = S(0, 0);
    s.xy[i] = S(0, 1);
    s.xz[i] = S(0, 2);
    s.yy[i] = S(1, 1);
    s.yz[i] = S(1, 2);
    s.zz[i] = S(2, 2);
  }
}

void
PointGatherer::gatherModelled(const std::vector<int>& indices, PointBatch& batch) const
{
  copyToCameraFrame(indices, batch);
  evaluateModel(batch);
}

/// Leaves the coordinates in the camera frame, where the model wants them.
void
PointGatherer::copyToCameraFrame(const std::vector<int>& indices,
                                 PointBatch& batch) const
{
  double* x = batch.channel(PointBatch::X);
  double* y = batch.channel(PointBatch::Y);
  double* z = batch.channel(PointBatch::Z);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const pcl::PointXYZ& p = (*cloud_.points)[indices[i]];
    if (in_camera_frame_) {
      x[i] = p.x;
      y[i] = p.y;
      z[i] = p.z;
      continue;
    }
    const Eigen::Vector3d q = to_camera_.toWorld(p.getVector3fMap().cast<double>());
    x[i] = q.x();
    y[i] = q.y();
    z[i] = q.z();
  }
}

void
PointGatherer::evaluateModel(PointBatch& batch) const
{
  const int n = batch.size();
  if (noise_at_surface_)
    computeReferencePoints(batch, Eigen::Vector3d::Zero());
  const auto at = [&](PointBatch::Channel measured, PointBatch::Channel reference) {
    return batch.channel(noise_at_surface_ ? reference : measured);
  };
  const double* z = at(PointBatch::Z, PointBatch::RZ);
  const CovarianceChannels s = covarianceChannels(batch);
  noise_->covariances(n,
                      at(PointBatch::X, PointBatch::RX),
                      at(PointBatch::Y, PointBatch::RY),
                      z,
                      s);
  if (!noise_->isOmnidirectional())
    for (int i = 0; i < n; ++i)
      s.xx[i] = z[i] > 0.0 ? s.xx[i] : kNoCovariance;
  if (!in_camera_frame_)
    rotate(cloud_.sensor_pose.R, n, s);
}

/// Pixels of the measured points, and directions at the points the model was asked at.
void
PointGatherer::sharePattern(PointBatch& batch) const
{
  const int n = batch.size();
  const double* const measured[3] = {batch.channel(PointBatch::X),
                                     batch.channel(PointBatch::Y),
                                     batch.channel(PointBatch::Z)};
  const double* const reference[3] = {batch.channel(PointBatch::RX),
                                      batch.channel(PointBatch::RY),
                                      batch.channel(PointBatch::RZ)};
  double* const direction[3] = {batch.channel(PointBatch::EX),
                                batch.channel(PointBatch::EY),
                                batch.channel(PointBatch::EZ)};
  double* __restrict u = batch.channel(PointBatch::U);
  double* __restrict v = batch.channel(PointBatch::V);
  const Camera camera = camera_; // a copy, which what is written does not change
  const auto [x, y, z] = measured;
  for (int i = 0; i < n; ++i) {
    const double inverse = 1.0 / z[i];
    u[i] = camera.fx * x[i] * inverse + camera.cx;
    v[i] = camera.fy * y[i] * inverse + camera.cy;
  }
  const bool at_reference = noise_at_surface_ && stored_.empty();
  noise_->patternDirections(n, at_reference ? reference : measured, direction);
  if (!in_camera_frame_)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector3d r =
          cloud_.sensor_pose.R *
          Eigen::Vector3d(direction[0][i], direction[1][i], direction[2][i]);
      for (int k = 0; k < 3; ++k)
        direction[k][i] = r[k];
    }
  batch.setPattern(pattern_);
}

} // namespace holdfast
