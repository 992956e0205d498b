#include "contact/field.h"

#include "contact/gaussian_events.h"
#include <holdfast/fusion/roughness.h>

#include <boost/math/special_functions/erf.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast::contact {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// One direction is integrated along, the others and friction are drawn.
constexpr int kDimensions = kField;

/// A dimension of Sobol's sequence: degree and coefficients of its polynomial, and the
/// first direction numbers (Joe and Kuo, SIAM J. Sci. Comput. 30, 2008).
struct SobolDimension {
  int degree;
  unsigned polynomial;
  unsigned first[5];
};
constexpr SobolDimension kSobol[] = {{1, 0, {1}},
                                     {2, 1, {1, 3}},
                                     {3, 1, {1, 3, 1}},
                                     {3, 2, {1, 1, 1}},
                                     {4, 1, {1, 1, 3, 3}},
                                     {4, 4, {1, 3, 5, 13}},
                                     {5, 2, {1, 1, 5, 5, 17}},
                                     {5, 4, {1, 1, 5, 5, 5}},
                                     {5, 7, {1, 1, 7, 11, 19}}};

/// Point n of kLines of a dimension as a multiple of 1/kLines; dimension 0 is van der
/// Corput's sequence.
unsigned
sobol(int dimension, unsigned n)
{
  unsigned direction[Lines::kLogLines];
  for (int i = 0; i < Lines::kLogLines; ++i) {
    direction[i] = 1;
    if (dimension == 0)
      continue;
    const SobolDimension& d = kSobol[dimension - 1];
    if (i < d.degree) {
      direction[i] = d.first[i];
      continue;
    }
    direction[i] = direction[i - d.degree] ^ (direction[i - d.degree] << d.degree);
    for (int k = 1; k < d.degree; ++k)
      if ((d.polynomial >> (d.degree - 1 - k) & 1U) != 0)
        direction[i] ^= direction[i - k] << k;
  }
  unsigned point = 0;
  for (int i = 0; i < Lines::kLogLines; ++i)
    if ((n >> i & 1U) != 0)
      point ^= direction[i] << (Lines::kLogLines - 1 - i);
  return point;
}

/// Standard normal numbers that fill the space evenly.
struct AllNodes {
  Lines::Nodes field; ///< none in the direction of the lines
  Lines::Row friction;
};

AllNodes
makeNodes()
{
  AllNodes nodes;
  nodes.field.setZero();
  for (int n = 0; n < Lines::kLines; ++n)
    for (int i = 0; i < kDimensions; ++i) {
      const double u = (sobol(i, static_cast<unsigned>(n)) + 0.5) / Lines::kLines;
      const double z = std::sqrt(2.0) * boost::math::erf_inv(2.0 * u - 1.0);
      float& node = i + 1 < kDimensions ? nodes.field(i + 1, n) : nodes.friction[n];
      node = static_cast<float>(z);
    }
  return nodes;
}

const AllNodes&
allNodes()
{
  static const AllNodes nodes = makeNodes();
  return nodes;
}

/// Rows of factor * nodes, without the packing that large products want.
void
placeNumbers(const FieldMatrix& factor, int first, int end, Lines::Nodes& places)
{
  const Lines::Nodes& nodes = allNodes().field;
  for (int i = first; i < end; ++i) {
    auto row = places.row(i).array();
    row.setZero();
    for (int k = 1; k < kField; ++k) // no node is along the first axis
      if (factor(i, k) != 0.0)
        row += static_cast<float>(factor(i, k)) * nodes.row(k).array();
  }
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
fieldAt(const ContactSurface& surface,
        const SurfaceHypothesis& hypothesis,
        const Pose& load)
{
  // What the quadric of a disc leaves of third derivatives, at the load's origin.
  const ThirdToJet by_third = movedThirdToJet(thirdToJetOfDisc(surface.radius_m),
                                              load.inverse() * surface.anchor);
  const std::optional<Jet> jet =
      transported(hypothesis.jet, surface.anchor, load, by_third);
  if (!jet || !jet->value.allFinite() || !isSeenSide(jet->value, surface.anchor, load))
    return std::nullopt;
  static const Eigen::Matrix4d kRoot = semidefiniteRoot(unitThirdDerivatives());
  Field field;
  field.mean << jet->value, Eigen::Vector4d::Zero();
  field.factor.setZero();
  // Curvatures first, so that what shows under a sole depends on the first nodes.
  Eigen::PermutationMatrix<6> curvatures_first;
  curvatures_first.indices() << 3, 4, 5, 0, 1, 2;
  const JetMatrix covariance =
      curvatures_first.transpose() * jet->covariance() * curvatures_first;
  field.factor.topLeftCorner<6, 6>() =
      curvatures_first * semidefiniteRoot<6>(covariance);
  const Eigen::Matrix4d third = hypothesis.s3_per_m2 * kRoot;
  field.factor.bottomRightCorner<4, 4>() = third;
  field.factor.topRightCorner<6, 4>() = -by_third * third;
  return field.factor.allFinite() ? std::optional(field) : std::nullopt;
}

std::optional<Field>
fieldAt(const ContactSurface& surface, const Pose& load)
{
  return fieldAt(surface, {1.0, surface.jet, surface.s3_per_m2}, load);
}

Lines::Lines(const Field& field) : field_(field)
{
  placeNumbers(field.factor, kShapeStart, kField, places_);
  setDirection(FieldVector::Unit(0));
}

void
Lines::setDirection(const FieldVector& event)
{
  FieldVector direction = field_.factor.transpose() * event;
  const double length = direction.norm();
  direction = length > 0.0 ? FieldVector(direction / length) : FieldVector::Unit(0);
  along_ = (field_.factor * direction).cast<float>();
  // The reflection that takes the first axis to the direction takes the nodes, which
  // are across the one, across the other.
  const FieldVector mirror =
      direction + (direction[0] > 0.0 ? 1.0 : -1.0) * FieldVector::Unit(0);
  const auto scaled = (mirror * (2.0 / mirror.squaredNorm())).cast<float>().eval();
  feet_.setZero();
  for (int k = 1; k < kField; ++k)
    if (scaled[k] != 0.0F)
      feet_ += scaled[k] * allNodes().field.row(k).array();
  step_ = (field_.factor * mirror).cast<float>();
  for (int i = kShapeStart; i < kField; ++i)
    startNumber(i);
  has_started_all_ = false;
  low_.setConstant(-kInfinity);
  high_.setConstant(kInfinity);
}

void
Lines::startNumber(int number)
{
  starts_.row(number) = places_.row(number).array() - step_[number] * feet_ +
                        static_cast<float>(field_.mean[number]);
}

void
Lines::startHeightAndSlopes()
{
  if (!has_placed_all_)
    placeNumbers(field_.factor, 0, kShapeStart, places_);
  for (int i = 0; i < kShapeStart && !has_started_all_; ++i)
    startNumber(i);
  has_placed_all_ = has_started_all_ = true;
}

void
Lines::keepWithin(const Row& middle, float along, float limit)
{
  if (std::abs(along) < std::numeric_limits<float>::min()) {
    low_ = (middle.abs() > limit).select(kInfinity, low_);
    return;
  }
  const float inverse = 1.0F / along, half = limit * std::abs(inverse);
  low_ = low_.max(-inverse * middle - half);
  high_ = high_.min(-inverse * middle + half);
}

void
Lines::keepShape(const ShapeRows& rows, const Eigen::VectorXd& own, double limit)
{
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Eigen::Matrix<float, 1, kShape> row = rows.row(i).cast<float>();
    const auto part = [&](int k) {
      return row[k] * starts_.row(kShapeStart + k).array();
    };
    static_assert(kShape == 7, "one term for each");
    const Row middle = part(0) + part(1) + part(2) + part(3) + part(4) + part(5) +
                       part(6) - static_cast<float>(own[i]);
    keepWithin(middle, row.dot(along_.tail<kShape>()), static_cast<float>(limit));
  }
}

void
Lines::keepHeight(double limit)
{
  startHeightAndSlopes();
  keepWithin(starts_.row(0).array(), along_[0], static_cast<float>(limit));
}

void
Lines::keepSlopes(const Eigen::Vector2d& centre, const Row& limits)
{
  startHeightAndSlopes();
  // |start + w along - centre|^2 <= limit^2, with all divided by |along|.
  const Eigen::Vector2f slope = along_.segment<2>(1), from = centre.cast<float>();
  const float length = slope.norm();
  const Row x = starts_.row(1).array() - from.x(),
            y = starts_.row(2).array() - from.y();
  if (length < std::numeric_limits<float>::min()) {
    low_ = (x.square() + y.square() > limits.square()).select(kInfinity, low_);
    return;
  }
  const Eigen::Vector2f u = slope / length;
  const Row foot = u.x() * x + u.y() * y, across = u.x() * y - u.y() * x;
  const Row squared = limits.square() - across.square();
  const Row half = squared.max(0.0F).sqrt() / length;
  low_ = (squared < 0.0F).select(kInfinity, low_.max(-foot / length - half));
  high_ = high_.min(-foot / length + half);
}

void
Lines::keepSlope(const Eigen::Vector2d& centre, double limit)
{
  keepSlopes(centre, Row::Constant(static_cast<float>(limit)));
}

void
Lines::keepFriction(const Friction& friction)
{
  const LogFriction mu(friction);
  const Row limits =
      (static_cast<float>(mu.mean) + static_cast<float>(mu.sigma) * allNodes().friction)
          .exp();
  keepSlopes(Eigen::Vector2d::Zero(), limits);
}

double
Lines::outside() const
{
  const NormalCdf& cdf = NormalCdf::table();
  double inside = 0.0;
  for (int n = 0; n < kLines; ++n)
    if (low_[n] < high_[n])
      inside += cdf.at(high_[n]) - cdf.at(low_[n]);
  return std::clamp(1.0 - inside / kLines, 0.0, 1.0);
}

} // namespace holdfast::contact
