#include "contact/field.h"

#include "contact/gaussian_events.h"
#include <holdfast/fusion/roughness.h>

#include <boost/math/special_functions/erf.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast::contact {
namespace {

/// Nodes of the field and one for friction.
constexpr int kDimensions = kField + 1;
using AllNodes = Eigen::Matrix<double, kDimensions, Lines::kLines>;

/// Standard normal numbers that fill the space evenly: multiples of the powers of the
/// generalised golden ratio x^(d+1) = x + 1, modulo 1, and each with its negative, so
/// that what is odd has no error.
AllNodes
makeNodes()
{
  double ratio = 1.0;
  for (int i = 0; i < 60; ++i) // a contraction
    ratio = std::pow(1.0 + ratio, 1.0 / (kDimensions + 1));
  AllNodes nodes;
  for (int n = 0; n < Lines::kLines / 2; ++n) {
    double step = 1.0;
    for (int i = 0; i < kDimensions; ++i) {
      step /= ratio;
      const double u = std::fmod(0.5 + (n + 1) * step, 1.0);
      nodes(i, 2 * n) = std::sqrt(2.0) * boost::math::erf_inv(2.0 * u - 1.0);
      nodes(i, 2 * n + 1) = -nodes(i, 2 * n);
    }
  }
  return nodes;
}

const AllNodes&
allNodes()
{
  static const AllNodes nodes = makeNodes();
  return nodes;
}

/// Whether the load comes from the side that was seen, which is above the plane of the
/// anchor everywhere.
bool
isSeenSide(const JetVector& jet_at_load, const Pose& anchor, const Pose& load)
{
  const Eigen::Vector3d against_load(-jet_at_load[1], -jet_at_load[2], 1.0);
  return anchor.R.col(2).dot(load.R * against_load) > 0.0;
}

/// Lower triangular root of a positive semi-definite matrix: what is certain has a
/// column of zeros.
template <int n>
Eigen::Matrix<double, n, n>
semidefiniteRoot(const Eigen::Matrix<double, n, n>& S)
{
  // Of a number's own variance, what is left once earlier numbers are known: below
  // this it is rounding.
  constexpr double kCertain = 1e-13;
  Eigen::Matrix<double, n, n> L = Eigen::Matrix<double, n, n>::Zero();
  for (int j = 0; j < n; ++j) {
    const double pivot = S(j, j) - L.row(j).head(j).squaredNorm();
    if (!(pivot > kCertain * S(j, j)))
      continue;
    L(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i)
      L(i, j) = (S(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
  }
  return L;
}

} // namespace

std::optional<Field>
fieldAt(const ContactSurface& surface, const Pose& load)
{
  // What the quadric of a disc leaves of third derivatives, at the load's origin.
  const ThirdToJet by_third = movedThirdToJet(thirdToJetOfDisc(surface.radius_m),
                                              load.inverse() * surface.anchor);
  const std::optional<Jet> jet =
      transported(surface.jet, surface.anchor, load, by_third);
  if (!jet || !jet->value.allFinite() || !isSeenSide(jet->value, surface.anchor, load))
    return std::nullopt;
  static const Eigen::Matrix4d kRoot = semidefiniteRoot(unitThirdDerivatives());
  Field field;
  field.mean << jet->value, Eigen::Vector4d::Zero();
  field.factor.setZero();
  field.factor.topLeftCorner<6, 6>() = semidefiniteRoot(jet->covariance());
  const Eigen::Matrix4d third = surface.s3_per_m2 * kRoot;
  field.factor.bottomRightCorner<4, 4>() = third;
  field.factor.topRightCorner<6, 4>() = -by_third * third;
  return field.factor.allFinite() ? std::optional(field) : std::nullopt;
}

Lines::Lines(const Field& field)
: field_(field)
, places_(field.factor * allNodes().topRows<kField>())
, along_(FieldVector::Zero())
{
  setDirection(FieldVector::Unit(0));
}

void
Lines::setDirection(const FieldVector& event)
{
  FieldVector direction = field_.factor.transpose() * event;
  const double length = direction.norm();
  direction = length > 0.0 ? FieldVector(direction / length) : FieldVector::Unit(0);
  along_ = field_.factor * direction;
  const Row feet = direction.transpose() * allNodes().topRows<kField>();
  starts_ = places_;
  starts_.noalias() -= along_ * feet.matrix();
  starts_.colwise() += field_.mean;
  clear();
}

void
Lines::clear()
{
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  low_.setConstant(-kInfinity);
  high_.setConstant(kInfinity);
}

void
Lines::keepWithin(const Row& middle, double along, double limit)
{
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (std::abs(along) < std::numeric_limits<double>::min()) {
    low_ = (middle.abs() > limit).select(kInfinity, low_);
    return;
  }
  const double inverse = 1.0 / along, half = limit * std::abs(inverse);
  low_ = low_.max(-inverse * middle - half);
  high_ = high_.min(-inverse * middle + half);
}

void
Lines::keepShape(const ShapeRows& rows, const Eigen::VectorXd& own, double limit)
{
  const ShapeVector along = along_.tail<kShape>();
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Row middle = (rows.row(i) * starts_.bottomRows<kShape>()).array() - own[i];
    keepWithin(middle, rows.row(i).dot(along), limit);
  }
}

void
Lines::keepHeight(double limit)
{
  keepWithin(starts_.row(0).array(), along_[0], limit);
}

void
Lines::keepSlopes(const Eigen::Vector2d& centre, const Row& limits)
{
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double a = along_.segment<2>(1).squaredNorm();
  for (int n = 0; n < kLines; ++n) {
    // |start + w along - centre|^2 = limit^2.
    const Eigen::Vector2d start = starts_.col(n).segment<2>(1) - centre;
    const double b = start.dot(along_.segment<2>(1));
    const double c = start.squaredNorm() - limits[n] * limits[n];
    const double discriminant = b * b - a * c;
    if (a < std::numeric_limits<double>::min() ? c > 0.0 : discriminant < 0.0)
      low_[n] = kInfinity;
    else if (a >= std::numeric_limits<double>::min()) {
      const double root = std::sqrt(discriminant);
      low_[n] = std::max(low_[n], (-b - root) / a);
      high_[n] = std::min(high_[n], (-b + root) / a);
    }
  }
}

void
Lines::keepSlope(const Eigen::Vector2d& centre, double limit)
{
  keepSlopes(centre, Row::Constant(limit));
}

void
Lines::keepFriction(const Friction& friction)
{
  const LogFriction mu(friction);
  const Row limits = (mu.mean + mu.sigma * allNodes().row(kField).array()).exp();
  keepSlopes(Eigen::Vector2d::Zero(), limits);
}

double
Lines::outside() const
{
  double inside = 0.0;
  for (int n = 0; n < kLines; ++n)
    if (low_[n] < high_[n])
      inside += normalCdf(high_[n]) - normalCdf(low_[n]);
  return std::clamp(1.0 - inside / kLines, 0.0, 1.0);
}

} // namespace holdfast::contact
