#include <holdfast/fusion/jet_filter.h>

#include <Eigen/Cholesky>

#include <limits>

namespace holdfast {
namespace {

using Joint = Eigen::Matrix<double, 12, 12>;

/// Covariance of the innovation j - x - b.
JetMatrix
innovation(const Joint& P, const JetMatrix& white)
{
  const JetMatrix S = P.topLeftCorner<6, 6>() + P.topRightCorner<6, 6>() +
                      P.bottomLeftCorner<6, 6>() + P.bottomRightCorner<6, 6>() + white;
  return S;
}

} // namespace

JetFilter::JetFilter(const Jet& first) : value_(first.value)
{
  // j = x + b + w, and nothing else is known of x.
  Joint P;
  P << first.covariance(), -first.pattern, -first.pattern, first.pattern;
  joint_ = Packed<12>::of(P);
}

JetFilter
JetFilter::restored(const JetVector& value,
                    const JetVector& pattern,
                    const Packed<12>& joint)
{
  JetFilter filter;
  filter.value_ = value;
  filter.pattern_ = pattern;
  filter.joint_ = joint;
  return filter;
}

void
JetFilter::changePattern(const JetVector& kept, const JetMatrix& pattern)
{
  const JetVector fresh = (1.0 - kept.array().square()).max(0.0).sqrt();
  Joint P = joint_.matrix();
  P.topRightCorner<6, 6>() = P.topRightCorner<6, 6>() * kept.asDiagonal();
  P.bottomLeftCorner<6, 6>() = P.topRightCorner<6, 6>().transpose();
  const JetMatrix left =
      kept.asDiagonal() * P.bottomRightCorner<6, 6>() * kept.asDiagonal();
  P.bottomRightCorner<6, 6>() =
      left + JetMatrix(fresh.asDiagonal() * pattern * fresh.asDiagonal());
  joint_ = Packed<12>::of(P);
  pattern_ = pattern_.cwiseProduct(kept).eval();
}

void
JetFilter::inflate(const JetMatrix& covariance)
{
  for (int i = 0, e = 0; i < 6; e += 6, ++i)
    for (int j = i; j < 6; ++j, ++e)
      joint_.v[static_cast<std::size_t>(e)] += covariance(i, j);
}

void
JetFilter::fade(double factor)
{
  inflate((factor - 1.0) * covariance());
}

double
JetFilter::distance(const JetVector& jet, const JetMatrix& white) const
{
  const Eigen::LLT<JetMatrix> S(innovation(joint_.matrix(), white));
  const JetVector r = jet - value_ - pattern_;
  const double squared = S.matrixL().solve(r).squaredNorm();
  // Written so that NaN is far, too.
  return S.info() == Eigen::Success && squared >= 0.0 ?
             squared :
             std::numeric_limits<double>::infinity();
}

bool
JetFilter::update(const JetVector& jet, const JetMatrix& white, double gate)
{
  const Joint P = joint_.matrix();
  const Eigen::LLT<JetMatrix> S(innovation(P, white));
  if (S.info() != Eigen::Success)
    return false;
  const JetVector r = S.matrixL().solve(jet - value_ - pattern_);
  // Written so that NaN is far, too.
  if (!(r.squaredNorm() <= gate))
    return false;
  // With S = L L^T and V = L^-1 [I I] P: P - V^T V, and a gain of V^T L^-1.
  const Eigen::Matrix<double, 6, 12> V =
      S.matrixL().solve(P.topRows<6>() + P.bottomRows<6>());
  const Eigen::Matrix<double, 12, 1> step = V.transpose() * r;
  const Joint updated = P - V.transpose() * V;
  if (!step.allFinite() || !updated.allFinite())
    return false;
  value_ += step.head<6>();
  pattern_ += step.tail<6>();
  joint_ = Packed<12>::of(updated);
  return true;
}

} // namespace holdfast
