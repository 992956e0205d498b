/// \file Derivatives by finite differences, the judge of every analytic Jacobian.
#pragma once

#include <Eigen/Core>

#include <algorithm>

namespace holdfast::test {

/// Jacobian of a vector function at x by the four-point central difference, error
/// h^4 f'''''/30 + eps |f|/h: about 1e-12 for the default step and functions whose
/// derivatives are about 1.
template <typename Function>
Eigen::MatrixXd
numericalJacobian(const Function& f, const Eigen::VectorXd& x, double step = 1e-3)
{
  const auto at = [&](Eigen::Index i, double h) -> Eigen::VectorXd {
    Eigen::VectorXd moved = x;
    moved(i) += h;
    return f(moved);
  };
  Eigen::MatrixXd J;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const Eigen::VectorXd near = at(i, step) - at(i, -step);
    const Eigen::VectorXd far = at(i, 2.0 * step) - at(i, -2.0 * step);
    if (i == 0)
      J.resize(near.size(), x.size());
    J.col(i) = (8.0 * near - far) / (12.0 * step);
  }
  return J;
}

/// Largest difference of two matrices in units of the largest entry of the expected
/// one, or of 1 where that is smaller.
template <typename DerivedA, typename DerivedB>
double
scaledError(const Eigen::MatrixBase<DerivedA>& actual,
            const Eigen::MatrixBase<DerivedB>& expected)
{
  const double scale = std::max(1.0, expected.cwiseAbs().maxCoeff());
  return (actual - expected).cwiseAbs().maxCoeff() / scale;
}

} // namespace holdfast::test
