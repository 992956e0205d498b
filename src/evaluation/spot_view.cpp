#include <holdfast/evaluation/spot_view.h>

#include <holdfast/simulation/reference_scenes.h>

#include <Eigen/Cholesky>

#include <boost/math/constants/constants.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace holdfast {
namespace {

/// The rays of every stride-th pixel that may see a ball, and where they lie.
RayGrid
raysAround(const Camera& camera,
           const Eigen::Vector3d& centre,
           double radius,
           int stride,
           Eigen::Vector2i& first)
{
  RayGrid rays;
  if (!(centre.z() > radius))
    return rays;
  const Eigen::Vector2d middle = camera.project(centre);
  const double reach = radius / (centre.z() - radius) *
                       (1.0 + centre.head<2>().norm() / centre.z()) *
                       std::max(camera.fx, camera.fy);
  const auto lowest = [&](double at) {
    return std::max(0, static_cast<int>(std::ceil((at - reach) / stride)));
  };
  const auto count = [&](double at, int from, int size) {
    const int end =
        static_cast<int>(std::floor(std::min(at + reach, size - 1.0) / stride));
    return std::max(0, end - from + 1);
  };
  first = {lowest(middle.x()), lowest(middle.y())};
  rays.width = count(middle.x(), first.x(), camera.width);
  rays.height = count(middle.y(), first.y(), camera.height);
  for (int v = 0; v < rays.height; ++v)
    for (int u = 0; u < rays.width; ++u)
      rays.directions.push_back(
          camera.backProject(stride * (first.x() + u), stride * (first.y() + v), 1.0));
  return rays;
}

} // namespace

std::optional<BestQuadric>
bestQuadric(const Scene& scene, const Pose& anchor, double radius_m)
{
  // Gauss points over the square of the radius and equal angles integrate polynomials
  // of the disc up to degree nine exactly.
  constexpr std::array<double, 5> kAt{0.0469100770306680,
                                      0.2307653449471585,
                                      0.5,
                                      0.7692346550528415,
                                      0.9530899229693320};
  constexpr std::array<double, 5> kWeight{0.1184634425280945,
                                          0.2393143352496832,
                                          0.2844444444444444,
                                          0.2393143352496832,
                                          0.1184634425280945};
  constexpr int kAngles = 12;
  constexpr double kAbove = 2.0; // radii
  const double turn = boost::math::constants::two_pi<double>() / kAngles;
  JetMatrix M = JetMatrix::Zero();
  JetVector b = JetVector::Zero();
  double squares = 0.0;
  for (std::size_t i = 0; i < kAt.size(); ++i)
    for (int k = 0; k < kAngles; ++k) {
      const double r = std::sqrt(kAt[i]);
      const double x = r * std::cos(turn * k), y = r * std::sin(turn * k);
      const auto hit =
          firstHit(scene,
                   anchor.toWorld(radius_m * Eigen::Vector3d(x, y, kAbove)),
                   -anchor.R.col(2));
      if (!hit || hit->t > 2.0 * kAbove * radius_m)
        return std::nullopt;
      const JetVector basis = jetBasis(x, y); // in radii
      const double height = kAbove * radius_m - hit->t;
      const double weight = kWeight[i] / kAngles;
      M += weight * basis * basis.transpose();
      b += weight * height * basis;
      squares += weight * height * height;
    }
  JetVector jet = M.ldlt().solve(b);
  const double residual = std::sqrt(std::max(0.0, squares - b.dot(jet)));
  jet.segment<2>(1) /= radius_m;
  jet.tail<3>() /= radius_m * radius_m;
  return BestQuadric{jet, residual};
}

std::optional<JetVector>
trueJet(const Scene& scene, const Pose& anchor, double radius_m)
{
  const auto best = bestQuadric(scene, anchor, radius_m);
  return best ? std::optional(best->jet) : std::nullopt;
}

SpotView::SpotView(const Scene& scene,
                   const Sensor& sensor,
                   const Pose& sensor_pose,
                   const Pose& disc,
                   double radius_m,
                   int stride)
{
  Scene seen = scene;
  seen.sensor_pose = sensor_pose;
  Eigen::Vector2i first = Eigen::Vector2i::Zero();
  const RayGrid rays = raysAround(sensor.camera,
                                  sensor_pose.toLocal(disc.c),
                                  1.5 * radius_m,
                                  stride,
                                  first);
  if (rays.width < 2 || rays.height < 2)
    return;
  RangeImage image = castRays(seen, rays);
  attachNoise(image, sensor);
  field_ = image.pattern;
  if (field_)
    noise_ = std::make_shared<const CorrelatedNoise>(sensor.pattern);
  const Eigen::Matrix3d to_camera = sensor_pose.R.transpose();
  for (std::size_t i = 0; i < image.truth.size(); ++i) {
    if (!image.truth[i].allFinite() ||
        disc.toLocal(image.truth[i]).head<2>().norm() > radius_m)
      continue;
    const auto column = static_cast<int>(i) % rays.width,
               row = static_cast<int>(i) / rays.width;
    Point point;
    point.truth = sensor_pose.toLocal(image.truth[i]);
    point.pixel = stride * Eigen::Vector2d(first.x() + column, first.y() + row);
    point.covariance = to_camera * image.covariances[i] * sensor_pose.R;
    point.root = to_camera * image.roots[i];
    point.shared = Eigen::Vector3d::Zero();
    if (field_)
      point.shared = to_camera * image.pattern_directions[i];
    point.in_window = i;
    point.pattern = 0.0;
    points_.push_back(point);
  }
}

void
SpotView::drawPattern(std::mt19937_64& generator)
{
  if (!field_)
    return;
  std::vector<double> field;
  field_->draw(generator, field);
  for (Point& point : points_)
    point.pattern = field[point.in_window];
}

std::optional<Measurement>
SpotView::measure(const PatchEstimator& estimator, std::mt19937_64& generator) const
{
  if (points_.empty())
    return std::nullopt;
  std::normal_distribution<double> normal;
  PointBatch batch;
  batch.clear(points_[points_.size() / 2].truth);
  batch.reserve(points());
  for (const Point& point : points_) {
    Eigen::Vector3d n;
    for (double& entry : n)
      entry = normal(generator);
    batch.add(point.truth + point.root * n + point.pattern * point.shared,
              point.covariance);
  }
  if (field_) {
    batch.setPattern(noise_);
    for (int i = 0; i < points(); ++i) {
      const Point& point = points_[static_cast<std::size_t>(i)];
      batch.channel(PointBatch::U)[i] = point.pixel.x();
      batch.channel(PointBatch::V)[i] = point.pixel.y();
      for (int axis = 0; axis < 3; ++axis)
        batch.channel(static_cast<PointBatch::Channel>(PointBatch::EX + axis))[i] =
            point.shared[axis];
    }
  }
  const FitResult fit = estimator.estimate(batch);
  return measurementOf(fit, batch);
}

} // namespace holdfast
