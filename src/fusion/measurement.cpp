#include <holdfast/fusion/measurement.h>

#include <boost/math/constants/constants.hpp>

#include <cmath>

namespace holdfast {
namespace {

/// Of the disc with these second moments on average: those of a disc are radius^2 / 4.
double
radiusOf(const Eigen::Vector3d& moments)
{
  return 2.0 * std::sqrt(0.5 * (moments[0] + moments[2]));
}

/// Everything but support and third derivatives.
std::optional<Measurement>
withoutSupport(const FitResult& fit, const Pose& sensor_pose)
{
  const PatchType type = fit.state.type;
  const StateLayout layout = stateLayoutOf(type);
  if (!isUsable(fit.status) || !isParaboloid(type.surface) || layout.m_count != 3)
    return std::nullopt;
  const Pose own = ownAnchor(fit);
  const auto jet = jetAt(fit, own);
  if (!jet)
    return std::nullopt;
  Measurement m;
  m.anchor = sensor_pose.inverse() * own;
  m.jet = *jet;
  m.radius_m = radiusOf(fit.state.moments);
  m.points = fit.points;
  m.moments = fit.state.moments;
  m.moments_covariance = fit.state_covariance.topLeftCorner<3, 3>();
  m.chi2 = fit.chi2;
  m.chi2_expected = fit.chi2_expected;
  return m;
}

SupportGrid
supportOf(const PointBatch& batch, const Pose& own, double radius_m)
{
  // A point stands for its share of the disc, and a little more: neighbours are no
  // regular grid.
  constexpr double kShare = 0.6; // of the spacing
  const double reach =
      kShare * std::sqrt(boost::math::constants::pi<double>() / batch.size());
  SupportGrid grid;
  for (int i = 0; i < batch.size(); ++i) {
    const Eigen::Vector3d q = own.toLocal(batch.point(i)) / radius_m;
    grid.mark(q.x(), q.y(), reach);
  }
  return grid;
}

SupportGrid
filledEllipse(const Eigen::Vector3d& moments, double radius_m)
{
  constexpr double kEdge = 4.0; // x^T M^-1 x at the end of a uniform ellipse
  const double determinant = moments[0] * moments[2] - moments[1] * moments[1];
  SupportGrid grid;
  for (int row = 0; row < SupportGrid::kCells; ++row)
    for (int column = 0; column < SupportGrid::kCells; ++column) {
      const double x = SupportGrid::middle(column) * radius_m,
                   y = SupportGrid::middle(row) * radius_m;
      if (x * x * moments[2] - 2.0 * x * y * moments[1] + y * y * moments[0] <=
          kEdge * determinant)
        grid.set(column, row);
    }
  return grid;
}

} // namespace

std::optional<Measurement>
measurementOf(const FitResult& fit, const PointBatch& batch, const Pose& sensor_pose)
{
  auto m = withoutSupport(fit, sensor_pose);
  if (!m)
    return m;
  const Pose own = ownAnchor(fit);
  m->support = supportOf(batch, own, m->radius_m);
  m->design = designOf(batch, own);
  return m;
}

std::optional<Measurement>
measurementOf(const FitResult& fit, const Pose& sensor_pose)
{
  auto m = withoutSupport(fit, sensor_pose);
  if (m) {
    m->support = filledEllipse(m->moments, m->radius_m);
    m->design.by_third = thirdToJetOfDisc(m->radius_m);
  }
  return m;
}

} // namespace holdfast
