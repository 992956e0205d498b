/// \file Covariance matrices: first-order propagation, checks, roots and sampling.
///
/// Templates over Eigen's dense types, so that fixed-size and bounded-size matrices
/// stay on the stack.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <random>

namespace holdfast {

/// J Sigma J^T, symmetrised.
template <typename DerivedJ, typename DerivedS>
auto propagate(const Eigen::MatrixBase<DerivedJ>& J,
               const Eigen::MatrixBase<DerivedS>& Sigma);

/// (A + A^T) / 2.
template <typename Derived>
typename Derived::PlainObject symmetrized(const Eigen::MatrixBase<Derived>& A);

/// True when A is finite, symmetric and positive semi-definite within rounding:
/// no entry differs from its transpose by more than tolerance times the largest entry,
/// and no eigenvalue is below -tolerance times the largest, by magnitude. The default
/// admits matrices that went through single precision. Empty matrices pass.
template <typename Derived>
bool isPositiveSemiDefinite(const Eigen::MatrixBase<Derived>& A,
                            double tolerance = 1e-6);

/// A symmetric square root S with S S^T = Sigma; eigenvalues below zero (rounding) are
/// taken as zero, so rank-deficient covariances are fine.
template <typename Derived>
typename Derived::PlainObject squareRoot(const Eigen::MatrixBase<Derived>& Sigma);

/// mean + root * n, n ~ N(0, I), from the caller's generator.
template <typename DerivedM, typename DerivedR, typename Generator>
typename DerivedM::PlainObject sampleGaussian(const Eigen::MatrixBase<DerivedM>& mean,
                                              const Eigen::MatrixBase<DerivedR>& root,
                                              Generator& generator);

} // namespace holdfast

#include <holdfast/geometry/impl/gaussian.hpp>
