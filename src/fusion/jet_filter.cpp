#include <holdfast/fusion/jet_filter.h>

#include <holdfast/fusion/roughness.h>

#include <Eigen/Cholesky>

#include <limits>

namespace holdfast {
namespace {

using Joint = Eigen::Matrix<double, 12, 12>;
using JointByThird = Eigen::Matrix<double, 12, 4>;

/// Of x + b, from those of [x b].
JetMatrix
ofSum(const Joint& P)
{
  return P.topLeftCorner<6, 6>() + P.topRightCorner<6, 6>() +
         P.bottomLeftCorner<6, 6>() + P.bottomRightCorner<6, 6>();
}

ThirdToJet
ofSum(const JointByThird& A)
{
  return A.topRows<6>() + A.bottomRows<6>();
}

JetMatrix
effectOf(const ThirdToJet& by_third, double s3_per_m2)
{
  return modelError(by_third, ThirdToJet::Zero(), s3_per_m2);
}

} // namespace

JetFilter::JetFilter(const Jet& first, const ThirdToJet& by_third, double s3_per_m2)
{
  state_.value = first.value;
  // j = x + b + D t + w, and nothing else is known of x.
  Joint P;
  P << first.covariance(), -first.pattern, -first.pattern, first.pattern;
  state_.joint = Packed<12, float>::of(P);
  state_.by_third.topRows<6>() = by_third.cast<float>();
  state_.s3_per_m2 = s3_per_m2;
}

JetMatrix
JetFilter::covariance() const
{
  return state_.joint.matrix().topLeftCorner<6, 6>() +
         effectOf(state_.by_third.topRows<6>().cast<double>(), state_.s3_per_m2);
}

void
JetFilter::changePattern(const JetVector& kept, const JetMatrix& pattern)
{
  const JetVector fresh = (1.0 - kept.array().square()).max(0.0).sqrt();
  Joint P = state_.joint.matrix();
  P.topRightCorner<6, 6>() = P.topRightCorner<6, 6>() * kept.asDiagonal();
  P.bottomLeftCorner<6, 6>() = P.topRightCorner<6, 6>().transpose();
  const JetMatrix left =
      kept.asDiagonal() * P.bottomRightCorner<6, 6>() * kept.asDiagonal();
  P.bottomRightCorner<6, 6>() =
      left + JetMatrix(fresh.asDiagonal() * pattern * fresh.asDiagonal());
  state_.joint = Packed<12, float>::of(P);
  state_.pattern = state_.pattern.cwiseProduct(kept).eval();
  state_.by_third.bottomRows<6>() =
      kept.cast<float>().asDiagonal() * state_.by_third.bottomRows<6>().eval();
}

void
JetFilter::inflate(const JetMatrix& covariance)
{
  for (int i = 0, e = 0; i < 6; e += 6, ++i)
    for (int j = i; j < 6; ++j, ++e)
      state_.joint.v[static_cast<std::size_t>(e)] +=
          static_cast<float>(covariance(i, j));
}

void
JetFilter::fade(double factor)
{
  inflate((factor - 1.0) * covariance());
}

double
JetFilter::distance(const JetVector& jet, const JetMatrix& white) const
{
  const JointByThird A = state_.by_third.cast<double>();
  const JetMatrix by_third = effectOf(ofSum(A), state_.s3_per_m2);
  const Eigen::LLT<JetMatrix> S(
      JetMatrix(ofSum(state_.joint.matrix()) + by_third + white));
  const JetVector r = jet - state_.value - state_.pattern;
  const double squared = S.matrixL().solve(r).squaredNorm();
  // Written so that NaN is far, too.
  return S.info() == Eigen::Success && squared >= 0.0 ?
             squared :
             std::numeric_limits<double>::infinity();
}

// The gain is that of views whose model errors are independent, the covariance what it
// then is with a common one. The best gain for that would weigh views against each
// other until third derivatives cancel, which is worth no more than the model of them.
bool
JetFilter::update(const JetVector& jet,
                  const JetMatrix& white,
                  double gate,
                  const ThirdToJet& by_third)
{
  const Joint P = state_.joint.matrix();
  const JointByThird A = state_.by_third.cast<double>();
  const ThirdToJet sum = ofSum(A);
  const Eigen::Matrix<double, 12, 6> G = P.leftCols<6>() + P.rightCols<6>();
  const JetMatrix N = ofSum(P) + white;
  const Eigen::LLT<JetMatrix> S(JetMatrix(N + effectOf(sum, state_.s3_per_m2) +
                                          effectOf(by_third, state_.s3_per_m2)));
  if (S.info() != Eigen::Success)
    return false;
  const JetVector r = jet - state_.value - state_.pattern;
  // Written so that NaN is far, too.
  if (!(S.matrixL().solve(r).squaredNorm() <= gate))
    return false;
  const Eigen::Matrix4d T =
      state_.s3_per_m2 * state_.s3_per_m2 * unitThirdDerivatives();
  const Eigen::Matrix<double, 12, 6> C = G + A * (T * sum.transpose());
  const Eigen::Matrix<double, 12, 6> K = S.solve(C.transpose()).transpose();
  const Eigen::Matrix<double, 12, 1> step = K * r;
  const Joint taken = K * G.transpose();
  const Joint updated = P - taken - taken.transpose() + K * N * K.transpose();
  if (!step.allFinite() || !updated.allFinite())
    return false;
  state_.value += step.head<6>();
  state_.pattern += step.tail<6>();
  state_.joint = Packed<12, float>::of(updated);
  state_.by_third = (A + K * (by_third - sum)).cast<float>();
  return true;
}

} // namespace holdfast
