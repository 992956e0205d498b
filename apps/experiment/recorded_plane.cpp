#include "recorded_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <cmath>
#include <random>

namespace holdfast::app {
namespace {

constexpr int kSamples = 1000;
constexpr int kSampleStep = 5; // px between the pixels that vote
constexpr double kSigmas = 4.0;
constexpr int kRefits = 20;

constexpr int kReach = 8; // px, half the side of a surrounding
constexpr double kLeastShare = 0.98;

/// Inverse depths of an image, 1/m, and the standard deviations of single ones.
struct InverseDepths {
  int width = 0;
  int height = 0;
  std::vector<double> value; ///< NaN: no point
  std::vector<double> sigma;

  std::size_t index(int u, int v) const
  {
    return static_cast<std::size_t>(v * width + u);
  }

  Eigen::Vector3d pixel(std::size_t i) const
  {
    const int k = static_cast<int>(i);
    return {static_cast<double>(k % width), static_cast<double>(k / width), 1.0};
  }

  /// False for pixels without a point.
  bool isOn(std::size_t i, const Eigen::Vector3d& plane) const
  {
    return std::abs(value[i] - plane.dot(pixel(i))) < kSigmas * sigma[i];
  }
};

InverseDepths
inverseDepthsOf(const RangeCloud& cloud, const NoiseModel& noise)
{
  InverseDepths image;
  image.width = static_cast<int>(cloud.points->width);
  image.height = static_cast<int>(cloud.points->height);
  const std::size_t n = cloud.points->size();
  image.value.assign(n, std::nan(""));
  image.sigma.assign(n, std::nan(""));
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d world = (*cloud.points)[i].getVector3fMap().cast<double>();
    const Eigen::Vector3d q = cloud.sensor_pose.toLocal(world);
    if (!(q.z() > 0.0)) // nor NaN
      continue;
    image.value[i] = 1.0 / q.z();
    image.sigma[i] = std::sqrt(noise.covariance(q)(2, 2)) / (q.z() * q.z());
  }
  return image;
}

/// a, b, c through three pixels; nothing where these lie on a line.
std::optional<Eigen::Vector3d>
planeThrough(const InverseDepths& image, const std::size_t (&at)[3])
{
  Eigen::Matrix3d A;
  Eigen::Vector3d value;
  for (int k = 0; k < 3; ++k) {
    A.row(k) = image.pixel(at[k]).transpose();
    value[k] = image.value[at[k]];
  }
  if (std::abs(A.determinant()) < 1.0)
    return std::nullopt;
  return A.inverse() * value;
}

/// The best of many planes through three pixels.
Eigen::Vector3d
samplePlane(const InverseDepths& image, std::uint64_t seed)
{
  std::vector<std::size_t> voters;
  for (int v = 0; v < image.height; v += kSampleStep)
    for (int u = 0; u < image.width; u += kSampleStep)
      if (std::isfinite(image.value[image.index(u, v)]))
        voters.push_back(image.index(u, v));
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  if (voters.size() < 3)
    return best;
  std::mt19937_64 generator(seed);
  std::size_t most = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    std::size_t at[3];
    for (std::size_t& i : at)
      i = voters[generator() % voters.size()];
    const auto plane = planeThrough(image, at);
    if (!plane)
      continue;
    std::size_t votes = 0;
    for (const std::size_t i : voters)
      votes += image.isOn(i, *plane) ? 1 : 0;
    if (votes > most) {
      most = votes;
      best = *plane;
    }
  }
  return best;
}

std::vector<bool>
pixelsOn(const InverseDepths& image, const Eigen::Vector3d& plane)
{
  std::vector<bool> on(image.value.size());
  for (std::size_t i = 0; i < on.size(); ++i)
    on[i] = image.isOn(i, plane);
  return on;
}

/// Weighted least squares; the pixels must not lie on a line.
Eigen::Vector3d
fitPlane(const InverseDepths& image, const std::vector<bool>& pixels)
{
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!pixels[i])
      continue;
    const double weight = 1.0 / (image.sigma[i] * image.sigma[i]);
    const Eigen::Vector3d p = image.pixel(i);
    A += weight * p * p.transpose();
    b += weight * image.value[i] * p;
  }
  return A.ldlt().solve(b);
}

/// Sums of `on` over all pixels above and to the left, one row and column more.
std::vector<int>
integralOf(const InverseDepths& image, const std::vector<bool>& on)
{
  const int stride = image.width + 1;
  std::vector<int> sums(static_cast<std::size_t>(stride * (image.height + 1)), 0);
  const auto at = [&](int u, int v) -> int& {
    return sums[static_cast<std::size_t>(v * stride + u)];
  };
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u)
      at(u + 1, v + 1) =
          at(u, v + 1) + at(u + 1, v) - at(u, v) + (on[image.index(u, v)] ? 1 : 0);
  return sums;
}

/// Those whose surroundings are in the image and nearly all on the plane, too.
std::vector<bool>
withoutRim(const InverseDepths& image, const std::vector<bool>& on)
{
  const std::vector<int> sums = integralOf(image, on);
  const auto at = [&](int u, int v) {
    return sums[static_cast<std::size_t>(v * (image.width + 1) + u)];
  };
  constexpr int kSide = 2 * kReach + 1;
  std::vector<bool> inside(on.size(), false);
  for (int v = kReach; v + kReach < image.height; ++v)
    for (int u = kReach; u + kReach < image.width; ++u) {
      const int left = u - kReach, top = v - kReach;
      const int count = at(left + kSide, top + kSide) - at(left, top + kSide) -
                        at(left + kSide, top) + at(left, top);
      inside[image.index(u, v)] =
          on[image.index(u, v)] && count >= kLeastShare * kSide * kSide;
    }
  return inside;
}

/// The pixels that hang together with one of them by their sides, which are taken out.
std::vector<std::size_t>
takePiece(const InverseDepths& image, std::size_t first, std::vector<bool>& pixels)
{
  std::vector<std::size_t> piece;
  const auto add = [&](int u, int v) {
    if (u < 0 || v < 0 || u >= image.width || v >= image.height ||
        !pixels[image.index(u, v)])
      return;
    pixels[image.index(u, v)] = false;
    piece.push_back(image.index(u, v));
  };
  const auto column = [&](std::size_t i) { return static_cast<int>(i) % image.width; };
  const auto row = [&](std::size_t i) { return static_cast<int>(i) / image.width; };
  add(column(first), row(first));
  for (std::size_t k = 0; k < piece.size(); ++k) {
    const int u = column(piece[k]), v = row(piece[k]);
    add(u - 1, v);
    add(u + 1, v);
    add(u, v - 1);
    add(u, v + 1);
  }
  return piece;
}

std::vector<std::size_t>
largestPiece(const InverseDepths& image, std::vector<bool> pixels)
{
  std::vector<std::size_t> largest;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (pixels[i]) {
      std::vector<std::size_t> piece = takePiece(image, i, pixels);
      if (piece.size() > largest.size())
        largest = std::move(piece);
    }
  return largest;
}

/// From a u + b v + c = 1/z, with z u = fx x + cx z: (n . q) = 1 in the camera frame.
void
setPlane(const Eigen::Vector3d& plane,
         const Camera& camera,
         const Pose& sensor_pose,
         RecordedPlane& result)
{
  const Eigen::Vector3d n(camera.fx * plane[0],
                          camera.fy * plane[1],
                          camera.cx * plane[0] + camera.cy * plane[1] + plane[2]);
  result.normal = sensor_pose.R * n.normalized();
  result.offset_m = 1.0 / n.norm() + result.normal.dot(sensor_pose.c);
}

} // namespace

std::optional<RecordedPlane>
findLargestPlane(const RangeCloud& cloud, const Sensor& sensor, std::uint64_t seed)
{
  const InverseDepths image = inverseDepthsOf(cloud, *sensor.noise);
  std::vector<bool> on = pixelsOn(image, samplePlane(image, seed));
  for (int refit = 0; refit < kRefits; ++refit) {
    std::vector<bool> next = pixelsOn(image, fitPlane(image, on));
    if (next == on)
      break;
    on = std::move(next);
  }
  const std::vector<std::size_t> piece = largestPiece(image, withoutRim(image, on));
  if (piece.size() < kLeastPlanePixels)
    return std::nullopt;
  RecordedPlane result;
  result.pixels = static_cast<int>(piece.size());
  result.inside.assign(on.size(), false);
  for (const std::size_t i : piece)
    result.inside[i] = true;
  const Eigen::Vector3d plane = fitPlane(image, result.inside);
  double squares = 0.0;
  for (const std::size_t i : piece) {
    squares +=
        std::pow((image.value[i] - plane.dot(image.pixel(i))) / image.sigma[i], 2);
    result.mean_depth_m += 1.0 / image.value[i] / result.pixels;
  }
  result.rms_sigmas = std::sqrt(squares / result.pixels);
  setPlane(plane, sensor.camera, cloud.sensor_pose, result);
  return result;
}

} // namespace holdfast::app
