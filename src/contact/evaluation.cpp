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

FieldRisk::FieldRisk(const Field& field,
                     const Foot& foot,
                     const Eigen::Vector2d& planned_slope)
: field_(field)
, foot_(foot)
, shape_mean_(field.shapeMean())
, shape_root_(field.shapeRoot())
, planned_slope_(planned_slope)
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

GaussianShare
FieldRisk::residual(const SolePlaces& places, Eigen::Index place) const
{
  const Eigen::Matrix<double, 1, kShape> row = places.rows.row(place);
  return {1.0,
          row.dot(shape_mean_) - places.own[place],
          row.lazyProduct(shape_root_).norm()};
}

double
FieldRisk::shareWithin(const SolePlaces& places, double limit) const
{
  double sum = 0.0;
  for (Eigen::Index i = 0; i < places.size(); ++i) {
    const GaussianShare off = residual(places, i);
    sum += 1.0 - outsideProbability(off.mean, off.sigma, limit);
  }
  return sum / static_cast<double>(places.size());
}

FieldRisk::GapByPlace
FieldRisk::gapByPlace(const SolePlaces& extremes) const
{
  GapByPlace gap;
  for (Eigen::Index i = 0; i < extremes.size(); ++i) {
    const GaussianShare off = residual(extremes, i);
    const double p = outsideProbability(off.mean, off.sigma, foot_.tolerances.gap_m);
    gap.sum += p;
    if (p > gap.largest) {
      gap.largest = p;
      gap.leading = i;
    }
  }
  return gap;
}

Range
FieldRisk::totalWithin(const SolePlaces& extremes) const
{
  const GapByPlace gap = gapByPlace(extremes);
  // As gapOf() has it.
  return {totalWith(gap.sum < kNegligible ? gap.sum : gap.largest),
          totalWith(gap.sum < kNegligible ? gap.sum : gap.most())};
}

double
FieldRisk::total(const SolePlaces& extremes)
{
  return totalWith(gapOf(extremes));
}

ContactEvents
FieldRisk::at(const SolePlaces& extremes)
{
  ContactEvents risk = common_;
  risk.gap = gapOf(extremes);
  risk.total = totalWith(risk.gap);
  risk.joint = jointOf(risk, extremes);
  return risk;
}

Lines&
FieldRisk::lines()
{
  return lines_ ? *lines_ : lines_.emplace(field_);
}

double
FieldRisk::gapOf(const SolePlaces& extremes)
{
  const GapByPlace gap = gapByPlace(extremes);
  if (gap.sum < kNegligible)
    return gap.sum;
  lines().setDirection(inField(extremes.rows.row(gap.leading).transpose()));
  lines().keepShape(extremes.rows, extremes.own, foot_.tolerances.gap_m);
  return std::clamp(lines().outside(), gap.largest, gap.most());
}

double
FieldRisk::jointOf(const ContactEvents& risk, const SolePlaces& extremes)
{
  const double slope = std::max(risk.slip, risk.tilt);
  const double largest = std::max({risk.height, risk.gap, slope});
  if (risk.total - largest <= kNegligible)
    return std::min(risk.total, 1.0);
  if (risk.gap < largest || risk.gap < kNegligible) {
    lines().setDirection(risk.height == largest ? FieldVector(FieldVector::Unit(0)) :
                                                  steepest());
    lines().keepShape(extremes.rows, extremes.own, foot_.tolerances.gap_m);
  } // else the lines are as gapOf() has left them
  lines().keepHeight(foot_.tolerances.height_m);
  lines().keepFriction(foot_.friction);
  if (foot_.ankle == Ankle::Stiff)
    lines().keepSlope(planned_slope_, std::tan(foot_.tolerances.tilt_rad));
  return std::clamp(lines().outside(),
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
                       const Foot& foot,
                       const Placement& placement)
: surface_(surface)
, foot_(foot)
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
Evaluation::at(const Sole& sole)
{
  ContactRisk result;
  if (!field_) {
    result.status = ContactStatus::NotFacingTheLoad;
    return result;
  }
  result.support_share = supportShare(sole);
  if (!isEnough(result.support_share))
    return result;

  result.status = ContactStatus::Ok;
  ContactQuality& quality = result.quality.emplace();
  ContactEvents& risk = quality.risk;
  risk = risksAt(sole);
  risk.support = 1.0 - result.support_share;
  risk.total = std::min(risk.total + risk.support, 1.0);
  risk.joint = 1.0 - (1.0 - risk.joint) * result.support_share;
  quality.cvar_gap_m = worstGap(sole);
  quality.contact_area_m2 = contactArea(sole);
  placeSole(sole.turn(), quality);
  return result;
}

std::vector<Evaluation::Part>&
Evaluation::parts()
{
  if (!parts_.empty())
    return parts_;
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
    part.risk.emplace(part.field, foot_, planned_slope_);
  }
  return parts_;
}

double
Evaluation::supportShare(const Sole& sole) const
{
  const Eigen::Matrix2Xd& cells = sole.cells().places;
  const Pose to_anchor = surface_.anchor.inverse() * load_;
  const double scale = 1.0 / surface_.radius_m;
  const Eigen::Matrix<double, 2, 3> to_grid = scale * to_anchor.R.topRows<2>();
  const Eigen::Vector2d origin = scale * to_anchor.c.head<2>();
  const JetVector jet = field_->mean.head<6>();
  int on_support = 0;
  for (const Eigen::Vector2d cell : cells.colwise()) {
    const double height = jetBasis(cell.x(), cell.y()).dot(jet);
    const Eigen::Vector2d q =
        to_grid * Eigen::Vector3d(cell.x(), cell.y(), height) + origin;
    on_support += surface_.support.contains(q.x(), q.y()) ? 1 : 0;
  }
  return static_cast<double>(on_support) / static_cast<double>(cells.cols());
}

double
Evaluation::total(const Sole& sole, double support_share)
{
  double total = 0.0;
  for (Part& part : parts())
    total += part.share * part.risk->total(extremesOf(sole));
  return std::min(total + (1.0 - support_share), 1.0);
}

Range
Evaluation::totalWithin(const Sole& sole, double support_share)
{
  Range total;
  for (const Part& part : parts()) {
    const Range one = part.risk->totalWithin(extremesOf(sole));
    total.low += part.share * one.low;
    total.high += part.share * one.high;
  }
  return {std::min(total.low + (1.0 - support_share), 1.0),
          std::min(total.high + (1.0 - support_share), 1.0)};
}

ContactEvents
Evaluation::risksAt(const Sole& sole)
{
  ContactEvents mean;
  for (Part& part : parts()) {
    const ContactEvents risk = part.risk->at(extremesOf(sole));
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
Evaluation::worstGap(const Sole& sole)
{
  const SolePlaces& extremes = extremesOf(sole);
  const Eigen::VectorXd mean = extremes.rows * field_->shapeMean() - extremes.own;
  const Eigen::VectorXd sigma = (extremes.rows * field_->shapeRoot()).rowwise().norm();
  Eigen::Index worst = 0;
  (mean.cwiseAbs() + 2.0 * sigma).maxCoeff(&worst);
  std::vector<GaussianShare> shares;
  for (const Part& part : parts()) {
    shares.push_back(part.risk->residual(extremes, worst));
    shares.back().share = part.share;
  }
  return tailMean(shares, kWorst);
}

double
Evaluation::contactArea(const Sole& sole)
{
  double share = 0.0;
  for (const Part& part : parts())
    share +=
        part.share * part.risk->shareWithin(sole.cells(), foot_.tolerances.contact_m);
  return sole.area() * share;
}

void
Evaluation::placeSole(double turn, ContactQuality& quality) const
{
  const bool is_stiff = foot_.ankle == Ankle::Stiff;
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
