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

/// Off the sole by N(mean, sigma^2) at each of its places.
struct Residuals {
  Eigen::VectorXd mean, sigma;

  Residuals(const SoleAtYaw& sole, const Field& field)
  : mean(sole.rows * field.shapeMean() - sole.own)
  , sigma((sole.rows * field.shapeFactor()).rowwise().norm())
  {}
};

} // namespace

FieldRisk::FieldRisk(const Field& field,
                     const Foot& foot,
                     const Eigen::Vector2d& planned_slope)
: field_(field), foot_(foot), planned_slope_(planned_slope), lines_(field)
{
  const Eigen::Vector2d slope = field.mean.segment<2>(1);
  const Eigen::Matrix2d covariance = field.slopeCovariance();
  common_.slip = slipProbability(slope, covariance, foot.friction);
  common_.height = outsideProbability(field.mean[0],
                                      field.factor.row(0).norm(),
                                      foot.tolerances.height_m);
  if (foot.ankle == Ankle::Stiff)
    common_.tilt = 1.0 - discProbability(slope - planned_slope,
                                         covariance,
                                         std::tan(foot.tolerances.tilt_rad));
}

ContactEvents
FieldRisk::at(const SoleAtYaw& extremes)
{
  ContactEvents risk = common_;
  risk.gap = gapOf(extremes);
  risk.total = risk.slip + risk.height + risk.tilt + risk.gap;
  risk.joint = jointOf(risk, extremes);
  return risk;
}

double
FieldRisk::gapOf(const SoleAtYaw& extremes)
{
  const double limit = foot_.tolerances.gap_m;
  const Residuals off(extremes, field_);
  double sum = 0.0, largest = -1.0;
  Eigen::Index leading = 0;
  for (Eigen::Index i = 0; i < off.mean.size(); ++i) {
    const double p = outsideProbability(off.mean[i], off.sigma[i], limit);
    sum += p;
    if (p > largest) {
      largest = p;
      leading = i;
    }
  }
  if (sum < kNegligible)
    return sum;
  lines_.setDirection(inField(extremes.rows.row(leading).transpose()));
  lines_.keepShape(extremes.rows, extremes.own, limit);
  return std::clamp(lines_.outside(), largest, std::max(largest, std::min(sum, 1.0)));
}

double
FieldRisk::jointOf(const ContactEvents& risk, const SoleAtYaw& extremes)
{
  const double slope = std::max(risk.slip, risk.tilt);
  const double largest = std::max({risk.height, risk.gap, slope});
  if (risk.total - largest <= kNegligible)
    return std::min(risk.total, 1.0);
  if (risk.gap < largest || risk.gap < kNegligible) {
    lines_.setDirection(risk.height == largest ? FieldVector(FieldVector::Unit(0)) :
                                                 steepest());
    lines_.keepShape(extremes.rows, extremes.own, foot_.tolerances.gap_m);
  } // else the lines are as gapOf() has left them
  lines_.keepHeight(foot_.tolerances.height_m);
  lines_.keepFriction(foot_.friction);
  if (foot_.ankle == Ankle::Stiff)
    lines_.keepSlope(planned_slope_, std::tan(foot_.tolerances.tilt_rad));
  return std::clamp(lines_.outside(),
                    largest,
                    std::max(largest, std::min(risk.total, 1.0)));
}

FieldVector
FieldRisk::steepest() const
{
  FieldVector event = FieldVector::Zero();
  event.segment<2>(1) = field_.mean.segment<2>(1);
  if (event.isZero(0.0))
    event[1] = 1.0;
  return event;
}

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
  if (parts_.empty())
    workOutParts();

  result.status = ContactStatus::Ok;
  const SoleAtYaw extremes(sole_.extremes(surface_.isQuadric()), turn);
  ContactQuality& quality = result.quality.emplace();
  ContactEvents& risk = quality.risk;
  risk = risksAt(extremes);
  risk.support = 1.0 - result.support_share;
  risk.total = std::min(risk.total + risk.support, 1.0);
  risk.joint = 1.0 - (1.0 - risk.joint) * result.support_share;
  quality.cvar_gap_m = worstGap(extremes);
  quality.contact_area_m2 = areaAt(turn);
  placeSole(turn, quality);
  return result;
}

void
Evaluation::workOutParts()
{
  // FieldRisk refers to the field beside it: no part may move any more.
  parts_.reserve(surface_.hypotheses.size() + 1);
  for (const SurfaceHypothesis& hypothesis : surface_.hypotheses)
    if (auto field = fieldAt(surface_, hypothesis, load_))
      parts_.push_back({hypothesis.share, *field, std::nullopt});
  if (parts_.empty())
    parts_.push_back({1.0, *field_, std::nullopt});
  double sum = 0.0;
  for (const Part& part : parts_)
    sum += part.share;
  for (Part& part : parts_) {
    part.share /= sum;
    part.risk.emplace(part.field, sole_.foot(), planned_slope_);
  }
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

ContactEvents
Evaluation::risksAt(const SoleAtYaw& extremes)
{
  ContactEvents mean;
  for (Part& part : parts_) {
    const ContactEvents risk = part.risk->at(extremes);
    for (double ContactEvents::*event : {&ContactEvents::slip,
                                         &ContactEvents::height,
                                         &ContactEvents::tilt,
                                         &ContactEvents::gap,
                                         &ContactEvents::total,
                                         &ContactEvents::joint})
      mean.*event += part.share * risk.*event;
  }
  return mean;
}

double
Evaluation::worstGap(const SoleAtYaw& extremes) const
{
  const Residuals overall(extremes, *field_);
  Eigen::Index worst = 0;
  (overall.mean.cwiseAbs() + 2.0 * overall.sigma).maxCoeff(&worst);
  std::vector<GaussianShare> shares;
  for (const Part& part : parts_) {
    const Residuals off(extremes, part.field);
    shares.push_back({part.share, off.mean[worst], off.sigma[worst]});
  }
  return tailMean(shares, kWorst);
}

double
Evaluation::areaAt(double turn) const
{
  const SoleAtYaw cells(sole_.cells(), turn);
  const double limit = sole_.foot().tolerances.contact_m;
  double share = 0.0;
  for (const Part& part : parts_) {
    const Residuals off(cells, part.field);
    for (Eigen::Index i = 0; i < off.mean.size(); ++i)
      share +=
          part.share * (1.0 - outsideProbability(off.mean[i], off.sigma[i], limit));
  }
  return sole_.area() * share / static_cast<double>(cells.own.size());
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
