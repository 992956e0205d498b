#include <holdfast/evaluation/contact_referee.h>

#include "geometry/polygon.h"
#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/gaussian.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

namespace holdfast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// [jet | xxx xxy xyy yyy].
using Surface = Eigen::Matrix<double, 10, 1>;

/// What each number of a surface adds to its height at a place.
Eigen::Matrix<double, 1, 10>
termsAt(const Vector2d& p)
{
  const double x = p.x(), y = p.y();
  Eigen::Matrix<double, 1, 10> terms;
  terms << jetBasis(x, y).transpose(), x * x * x / 6.0, x * x * y / 2.0,
      x * y * y / 2.0, y * y * y / 6.0;
  return terms;
}

/// Places of a square raster that lie in a sole.
std::vector<Vector2d>
rasterOf(const Foot& foot, int cells)
{
  const double cell = 2.0 * soleReach(foot) / cells;
  std::vector<Vector2d> raster;
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      const Vector2d p = cell * Vector2d(i + 0.5 - 0.5 * cells, j + 0.5 - 0.5 * cells);
      if (isInside(foot.sole, p))
        raster.push_back(p);
    }
  return raster;
}

/// How far the surface is off the plane that lies best under the sole, at its corners,
/// the middles of its edges and its own: rows of a surface in the axes of the sole.
Eigen::Matrix<double, Eigen::Dynamic, 10>
residualRows(const Foot& foot)
{
  // So fine that what its edge cuts off is 0.1 % of the sole.
  const std::vector<Vector2d> raster = rasterOf(foot, 1000);
  const double scale = soleReach(foot); // the terms of the plane in like units
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 10> X = Eigen::Matrix<double, 3, 10>::Zero();
  for (const Vector2d& p : raster) {
    const Vector3d b(1.0, p.x() / scale, p.y() / scale);
    M += b * b.transpose();
    X += b * termsAt(p);
  }
  Eigen::Matrix<double, 3, 10> plane = M.llt().solve(X);
  plane.bottomRows<2>() /= scale;

  std::vector<Vector2d> places;
  places.emplace_back(scale * M.col(0).tail<2>() / M(0, 0));
  for (std::size_t i = 0; i < foot.sole.size(); ++i) {
    places.push_back(foot.sole[i]);
    places.emplace_back(0.5 * (foot.sole[i] + foot.sole[(i + 1) % foot.sole.size()]));
  }
  Eigen::Matrix<double, Eigen::Dynamic, 10> rows(places.size(), 10);
  for (std::size_t i = 0; i < places.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) =
        termsAt(places[i]) -
        Vector3d(1.0, places[i].x(), places[i].y()).transpose() * plane;
  return rows;
}

/// A surface that can be drawn.
struct DrawnSurface {
  Surface mean;
  Eigen::Matrix<double, 10, 10> root;

  DrawnSurface(const Jet& jet, const ThirdToJet& by_third, double s3_per_m2)
  {
    mean << jet.value, Eigen::Vector4d::Zero();
    root.setZero();
    const Eigen::Matrix4d third = s3_per_m2 * squareRoot(unitThirdDerivatives());
    root.topLeftCorner<6, 6>() = squareRoot(jet.covariance());
    root.topRightCorner<6, 4>() = -by_third * third;
    root.bottomRightCorner<4, 4>() = third;
  }
};

} // namespace

double
drawFriction(const Friction& friction, std::mt19937_64& generator)
{
  const double variance = std::log1p(std::pow(friction.sigma / friction.mean, 2));
  std::normal_distribution<double> normal(-0.5 * variance, std::sqrt(variance));
  return friction.mean * std::exp(normal(generator));
}

std::optional<ContactEvents>
drawnContactEvents(const ContactSurface& surface,
                   const Foot& foot,
                   const Placement& placement,
                   int draws,
                   std::mt19937_64& generator)
{
  for (const std::string& error : {validityError(foot), validityError(placement)})
    if (!error.empty())
      throw std::invalid_argument(error);
  const Pose load = loadFrame(placement);
  const ThirdToJet by_third = movedThirdToJet(thirdToJetOfDisc(surface.radius_m),
                                              load.inverse() * surface.anchor);
  const auto jet = transported(surface.jet, surface.anchor, load, by_third);
  if (!jet)
    return std::nullopt;
  const DrawnSurface drawn(*jet, by_third, surface.s3_per_m2);
  const auto rows = residualRows(foot);
  Surface own = Surface::Zero(); // of the sole
  own[3] = foot.curvature.x();
  own[5] = foot.curvature.y();
  Vector2d planned = jet->value.segment<2>(1);
  if (placement.sole_normal) {
    const Vector3d n = load.R.transpose() * *placement.sole_normal;
    planned = -n.head<2>() / n.z();
  }

  const ContactTolerances& t = foot.tolerances;
  std::normal_distribution<double> normal;
  ContactEvents counts;
  for (int i = 0; i < draws; ++i) {
    const Surface s = drawn.mean + drawn.root * Surface::NullaryExpr(
                                                    [&] { return normal(generator); });
    const Vector2d slope = s.segment<2>(1);
    const bool slips = slope.norm() > drawFriction(foot.friction, generator);
    const bool is_high = std::abs(s[0]) > t.height_m;
    const bool tilts =
        foot.ankle == Ankle::Stiff && (slope - planned).norm() > std::tan(t.tilt_rad);
    const bool gapes = ((rows * (s - own)).array().abs() > t.gap_m).any();
    counts.slip += slips ? 1.0 : 0.0;
    counts.height += is_high ? 1.0 : 0.0;
    counts.tilt += tilts ? 1.0 : 0.0;
    counts.gap += gapes ? 1.0 : 0.0;
    counts.joint += slips || is_high || tilts || gapes ? 1.0 : 0.0;
  }
  for (double* count :
       {&counts.slip, &counts.height, &counts.tilt, &counts.gap, &counts.joint})
    *count /= draws;
  counts.total = std::min(1.0, counts.slip + counts.height + counts.tilt + counts.gap);
  return counts;
}

std::optional<TrueContact>
trueContact(const Scene& scene, const Foot& foot, const Pose& load, double reach_m)
{
  const auto heightAt = [&](const Vector2d& p) -> std::optional<double> {
    const Vector3d start = load.toWorld({p.x(), p.y(), reach_m});
    const std::optional<Hit> hit = firstHit(scene, start, -load.R.col(2));
    if (!hit || hit->t > 2.0 * reach_m)
      return std::nullopt;
    return reach_m - hit->t;
  };
  constexpr double kStep = 2e-3; // m: far below what a patch tells, above rounding
  double height[5];
  const Vector2d star[5] = {{0.0, 0.0},
                            {kStep, 0.0},
                            {-kStep, 0.0},
                            {0.0, kStep},
                            {0.0, -kStep}};
  for (int i = 0; i < 5; ++i) {
    const std::optional<double> z = heightAt(star[i]);
    if (!z)
      return std::nullopt;
    height[i] = *z;
  }
  TrueContact contact;
  contact.height_m = height[0];
  contact.slope =
      Vector2d(height[1] - height[2], height[3] - height[4]) / (2.0 * kStep);

  const std::vector<Vector2d> raster = rasterOf(foot, 24);
  Eigen::MatrixX3d plane(raster.size(), 3);
  Eigen::VectorXd z(raster.size());
  for (std::size_t i = 0; i < raster.size(); ++i) {
    const Vector2d& p = raster[i];
    const std::optional<double> at = heightAt(p);
    if (!at)
      return std::nullopt;
    const auto row = static_cast<Eigen::Index>(i);
    plane.row(row) << 1.0, p.transpose();
    z[row] = *at - 0.5 * (foot.curvature.x() * p.x() * p.x() +
                          foot.curvature.y() * p.y() * p.y());
  }
  const Vector3d best = (plane.transpose() * plane).ldlt().solve(plane.transpose() * z);
  contact.gap_m = (z - plane * best).cwiseAbs().maxCoeff();
  return contact;
}

} // namespace holdfast
