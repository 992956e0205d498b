#include "contact/evaluation.h"

#include "contact/gaussian_events.h"
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace holdfast::contact {
namespace {

/// The share of the worst cases that a tail mean is over.
constexpr double kWorst = 0.05;

/// Below this a probability is the sum of its parts: what these have in common is less.
constexpr double kNegligible = 1e-6;

/// Coefficients of a row of a sole in the whole field.
FieldVector
inField(const Eigen::Ref<const ShapeVector>& row)
{
  FieldVector event = FieldVector::Zero();
  event.tail<kShape>() = row;
  return event;
}

Eigen::Vector3d
normalOf(const Eigen::Vector2d& slope)
{
  return Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
}

} // namespace

Evaluation::Evaluation(const ContactSurface& surface,
                       const Sole& sole,
                       const Placement& placement)
: surface_(surface)
, sole_(sole)
, load_(loadFrame(placement))
, field_(fieldAt(surface, load_))
{
  if (!field_)
    return;
  planned_slope_ = field_->mean.segment<2>(1);
  if (placement.sole_normal) {
    const Eigen::Vector3d n = load_.R.transpose() * *placement.sole_normal;
    planned_slope_ = -n.head<2>() / n.z();
  }
}

ContactRisk
Evaluation::atYaw(double turn)
{
  ContactRisk result;
  if (!field_) {
    result.status = ContactStatus::NotFacingTheLoad;
    return result;
  }
  result.support_share = supportShare(turn);
  if (result.support_share < sole_.foot().tolerances.min_support)
    return result;
  result.status = ContactStatus::Ok;
  if (!common_)
    workOutCommon();

  ContactQuality& quality = result.quality.emplace();
  ContactEvents& risk = quality.risk;
  risk = *common_;
  risk.support = 1.0 - result.support_share;
  const SolePlaces& places = sole_.extremes(surface_.s3_per_m2 == 0.0);
  const Residuals extremes = residualsOf(places, turn);
  risk.gap = gapOf(extremes, places.own);
  const double sum = risk.slip + risk.height + risk.tilt + risk.gap + risk.support;
  risk.total = std::min(sum, 1.0);
  risk.joint = jointOf(risk, extremes, places.own);
  Eigen::Index worst = 0;
  (extremes.mean.cwiseAbs() + 2.0 * extremes.sigma).maxCoeff(&worst);
  quality.cvar_gap_m = tailMean(extremes.mean[worst], extremes.sigma[worst], kWorst);
  quality.contact_area_m2 = areaAt(turn);
  placeSole(turn, quality);
  return result;
}

double
Evaluation::supportShare(double turn) const
{
  const Eigen::Matrix2Xd& cells = sole_.cells().places;
  const Pose to_anchor = surface_.anchor.inverse() * load_;
  const JetVector jet = field_->mean.head<6>();
  const Eigen::Matrix2d T = Eigen::Rotation2Dd(turn).toRotationMatrix();
  int on_support = 0;
  for (const Eigen::Vector2d cell : cells.colwise()) {
    const Eigen::Vector2d p = T * cell;
    const double height = jetBasis(p.x(), p.y()).dot(jet);
    const Eigen::Vector3d q =
        to_anchor.toWorld({p.x(), p.y(), height}) / surface_.radius_m;
    on_support += surface_.support.contains(q.x(), q.y()) ? 1 : 0;
  }
  return static_cast<double>(on_support) / static_cast<double>(cells.cols());
}

Evaluation::Residuals
Evaluation::residualsOf(const SolePlaces& places, double turn) const
{
  Residuals result;
  result.rows = turnedRows(places.rows, turn);
  result.mean = result.rows * field_->shapeMean() - places.own;
  result.sigma = (result.rows * field_->shapeFactor()).rowwise().norm();
  return result;
}

void
Evaluation::workOutCommon()
{
  const Foot& foot = sole_.foot();
  const Eigen::Vector2d slope = field_->mean.segment<2>(1);
  const Eigen::Matrix2d covariance = field_->slopeCovariance();
  ContactEvents& common = common_.emplace();
  common.slip = slipProbability(slope, covariance, foot.friction);
  common.height = outsideProbability(field_->mean[0],
                                     field_->factor.row(0).norm(),
                                     foot.tolerances.height_m);
  if (foot.ankle == Ankle::Stiff)
    common.tilt = 1.0 - discProbability(slope - planned_slope_,
                                        covariance,
                                        std::tan(foot.tolerances.tilt_rad));
  lines_.emplace(*field_);
}

double
Evaluation::gapOf(const Residuals& extremes, const Eigen::VectorXd& own)
{
  const double limit = sole_.foot().tolerances.gap_m;
  double sum = 0.0, largest = -1.0;
  Eigen::Index leading = 0;
  for (Eigen::Index i = 0; i < own.size(); ++i) {
    const double p = outsideProbability(extremes.mean[i], extremes.sigma[i], limit);
    sum += p;
    if (p > largest) {
      largest = p;
      leading = i;
    }
  }
  if (sum < kNegligible)
    return sum;
  lines_->setDirection(inField(extremes.rows.row(leading).transpose()));
  lines_->keepShape(extremes.rows, own, limit);
  return std::clamp(lines_->outside(), largest, std::min(sum, 1.0));
}

double
Evaluation::jointOf(const ContactEvents& risk,
                    const Residuals& extremes,
                    const Eigen::VectorXd& own)
{
  const double slope = std::max(risk.slip, risk.tilt);
  const double largest = std::max({risk.height, risk.gap, slope});
  const double sum = risk.slip + risk.height + risk.tilt + risk.gap;
  double any = sum;
  if (sum - largest > kNegligible) {
    const Foot& foot = sole_.foot();
    if (risk.gap < largest) { // else the lines are as the gap has left them
      lines_->setDirection(risk.height == largest ? FieldVector(FieldVector::Unit(0)) :
                                                    steepest());
      lines_->keepShape(extremes.rows, own, foot.tolerances.gap_m);
    }
    lines_->keepHeight(foot.tolerances.height_m);
    lines_->keepFriction(foot.friction);
    if (foot.ankle == Ankle::Stiff)
      lines_->keepSlope(planned_slope_, std::tan(foot.tolerances.tilt_rad));
    any = std::clamp(lines_->outside(), largest, std::min(sum, 1.0));
  }
  return 1.0 - (1.0 - std::min(any, 1.0)) * (1.0 - risk.support);
}

FieldVector
Evaluation::steepest() const
{
  FieldVector event = FieldVector::Zero();
  event.segment<2>(1) = field_->mean.segment<2>(1);
  if (event.isZero(0.0))
    event[1] = 1.0;
  return event;
}

double
Evaluation::areaAt(double turn) const
{
  const SolePlaces& cells = sole_.cells();
  const Residuals off = residualsOf(cells, turn);
  double share = 0.0;
  for (Eigen::Index i = 0; i < cells.size(); ++i)
    share += 1.0 - outsideProbability(off.mean[i],
                                      off.sigma[i],
                                      sole_.foot().tolerances.contact_m);
  return sole_.area() * share / static_cast<double>(cells.size());
}

void
Evaluation::placeSole(double turn, ContactQuality& quality) const
{
  const bool is_stiff = sole_.foot().ankle == Ankle::Stiff;
  const Eigen::Vector2d slope =
      is_stiff ? planned_slope_ : Eigen::Vector2d(field_->mean.segment<2>(1));
  const Eigen::Vector3d n = normalOf(slope); // frame of the load
  const Eigen::Vector3d forward(std::cos(turn), std::sin(turn), 0.0);
  const Eigen::Vector3d across = forward - n * n.dot(forward);
  const Eigen::Vector3d x = across.normalized(), y = n.cross(x);
  quality.pose.R << load_.R * x, load_.R * y, load_.R * n;
  quality.pose.c = load_.toWorld({0.0, 0.0, field_->mean[0]});

  // (delta, c) by (h, gx, gy). The normal turns by dn = x delta_y - y delta_x, and x
  // stays in the plane of n and the forward direction: y dx = -(f n)(y dn) / |across|.
  Eigen::Matrix<double, 6, 3> J = Eigen::Matrix<double, 6, 3>::Zero();
  J.col(0).tail<3>() = load_.R.col(2);
  for (int a = 0; !is_stiff && a < 2; ++a) {
    Eigen::Vector3d dn = -Eigen::Vector3d::Unit(a) * n.z();
    dn -= n * n.dot(dn);
    J(0, 1 + a) = -y.dot(dn);
    J(1, 1 + a) = x.dot(dn);
    J(2, 1 + a) = -forward.dot(n) * y.dot(dn) / across.norm();
  }
  const Eigen::Matrix<double, 6, kField> F = J * field_->factor.topRows<3>();
  quality.pose_covariance = F * F.transpose();
}

} // namespace holdfast::contact
