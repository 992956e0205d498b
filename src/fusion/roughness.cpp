#include <holdfast/fusion/roughness.h>

#include "geometry/symmetric.h"
#include "third_derivatives.h"

#include <Eigen/Cholesky>

namespace holdfast {
namespace {

/// The jet at 0 of a cubic's terms of lower degree, once it is written about another
/// origin u and has lost its cubic terms there.
ThirdToJet
shiftOfThird(const Eigen::Vector2d& origin)
{
  const double u = origin.x(), v = origin.y();
  ThirdToJet B;
  // clang-format off
  B << u * u * u / 6.0, u * u * v / 2.0, u * v * v / 2.0, v * v * v / 6.0,
       -u * u / 2.0, -u * v, -v * v / 2.0, 0.0,
       0.0, -u * u / 2.0, -u * v, -v * v / 2.0,
       u, v, 0.0, 0.0,
       0.0, u, v, 0.0,
       0.0, 0.0, u, v;
  // clang-format on
  return B;
}

/// The jet at 0 of a quadric with a jet at u in axes that are the columns of W.
JetMatrix
shiftOfJet(const Eigen::Vector2d& u, const Eigen::Matrix2d& W)
{
  JetMatrix J = JetMatrix::Zero();
  const Eigen::Vector2d s = -W.transpose() * u; // the new origin in the old axes
  J.row(0) = jetBasis(s.x(), s.y());
  Eigen::Matrix<double, 2, 6> gradient; // there, old axes
  gradient << 0.0, 1.0, 0.0, s.x(), s.y(), 0.0, 0.0, 0.0, 1.0, 0.0, s.x(), s.y();
  J.middleRows<2>(1) = W * gradient;
  J.bottomRightCorner<3, 3>() = symmetric::planeTurn(W);
  return J;
}

} // namespace

FitDesign
designOf(const PointBatch& batch, const Pose& anchor)
{
  JetMatrix M = JetMatrix::Zero();
  ThirdToJet X = ThirdToJet::Zero();
  Eigen::Matrix4d T = Eigen::Matrix4d::Zero();
  const Eigen::Vector3d n = anchor.R.col(2);
  for (int i = 0; i < batch.size(); ++i) {
    // A residual along the ray counts in sigmas of the normal's direction.
    const double weight = 1.0 / n.dot(batch.covariance(i) * n);
    const Eigen::Vector3d q = anchor.toLocal(batch.point(i));
    const JetVector b = jetBasis(q.x(), q.y());
    const Eigen::Vector4d m = cubicBasis(q.x(), q.y());
    const JetVector weighted = weight * b;
    M.noalias() += weighted * b.transpose();
    X.noalias() += weighted * m.transpose();
    T.noalias() += (weight * m) * m.transpose();
  }
  // Scaled to a unit diagonal: units differ by powers of the radius.
  const JetVector scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const JetMatrix scaled = scale.asDiagonal() * M * scale.asDiagonal();
  const ThirdToJet right = scale.asDiagonal() * X;
  const ThirdToJet fit = scaled.ldlt().solve(right);
  const Eigen::Matrix4d left = T - right.transpose() * fit;
  return {scale.asDiagonal() * fit, left.cwiseProduct(unitThirdDerivatives()).sum()};
}

ThirdToJet
movedThirdToJet(const ThirdToJet& own, const Pose& pose)
{
  // About the own anchor a cubic is one with the same third derivatives, in turned
  // axes, and a quadric, which any fit reproduces.
  const Eigen::Vector2d u = pose.c.head<2>();
  const Eigen::Matrix2d W = pose.R.topLeftCorner<2, 2>();
  return shiftOfThird(u) + shiftOfJet(u, W) * own * turnOfThird(W);
}

} // namespace holdfast
