#pragma once

#include <holdfast/geometry/gaussian.h>

namespace holdfast {

template <typename DerivedJ, typename DerivedS>
auto
propagate(const Eigen::MatrixBase<DerivedJ>& J,
          const Eigen::MatrixBase<DerivedS>& Sigma)
{
  using Result = Eigen::Matrix<typename DerivedJ::Scalar,
                               DerivedJ::RowsAtCompileTime,
                               DerivedJ::RowsAtCompileTime,
                               Eigen::ColMajor,
                               DerivedJ::MaxRowsAtCompileTime,
                               DerivedJ::MaxRowsAtCompileTime>;
  const Result product = J * Sigma * J.transpose();
  return symmetrized(product);
}

template <typename Derived>
typename Derived::PlainObject
symmetrized(const Eigen::MatrixBase<Derived>& A)
{
  return 0.5 * (A + A.transpose());
}

template <typename Derived>
bool
isPositiveSemiDefinite(const Eigen::MatrixBase<Derived>& A, double tolerance)
{
  using Plain = typename Derived::PlainObject;
  if (A.size() == 0)
    return true;
  if (A.rows() != A.cols() || !A.allFinite())
    return false;
  // Halved before the difference, so that entries near the largest double stay finite.
  const Plain asymmetry = 0.5 * A - 0.5 * A.transpose();
  if (asymmetry.cwiseAbs().maxCoeff() > 0.5 * tolerance * A.cwiseAbs().maxCoeff())
    return false;
  const Plain symmetric = 0.5 * A + 0.5 * A.transpose();
  const Eigen::SelfAdjointEigenSolver<Plain> solver(symmetric, Eigen::EigenvaluesOnly);
  const auto& lambda = solver.eigenvalues(); // ascending
  return lambda(0) >= -tolerance * lambda.cwiseAbs().maxCoeff();
}

template <typename Derived>
typename Derived::PlainObject
squareRoot(const Eigen::MatrixBase<Derived>& Sigma)
{
  using Plain = typename Derived::PlainObject;
  if (Sigma.size() == 0)
    return Sigma;
  const Eigen::SelfAdjointEigenSolver<Plain> solver(symmetrized(Sigma));
  const auto roots = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().eval();
  const Plain scaled = solver.eigenvectors() * roots.asDiagonal();
  return scaled * solver.eigenvectors().transpose();
}

template <typename DerivedM, typename DerivedR, typename Generator>
typename DerivedM::PlainObject
sampleGaussian(const Eigen::MatrixBase<DerivedM>& mean,
               const Eigen::MatrixBase<DerivedR>& root,
               Generator& generator)
{
  using Noise = Eigen::Matrix<typename DerivedR::Scalar,
                              DerivedR::ColsAtCompileTime,
                              1,
                              Eigen::ColMajor,
                              DerivedR::MaxColsAtCompileTime,
                              1>;
  std::normal_distribution<typename DerivedR::Scalar> standard_normal;
  Noise noise(root.cols());
  for (Eigen::Index i = 0; i < noise.size(); ++i)
    noise(i) = standard_normal(generator);
  return mean + root * noise;
}

} // namespace holdfast
