/// \file Cholesky factors of small symmetric matrices of fixed size: a fit asks for a
/// dozen, with pivots and inverses, and Eigen's are made for matrices of any size.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <limits>

namespace holdfast {

/// S = L L^T.
template <int n>
class SmallCholesky {
public:
  using Vector = Eigen::Matrix<double, n, 1, Eigen::DontAlign>;
  using Matrix = Eigen::Matrix<double, n, n, Eigen::DontAlign>;

  /// \param S any symmetric matrix; the lower triangle counts.
  template <typename Derived>
  explicit SmallCholesky(const Eigen::MatrixBase<Derived>& S)
  {
    for (int j = 0; j < n; ++j) {
      double pivot = S(j, j);
      for (int k = 0; k < j; ++k)
        pivot -= L_[j][k] * L_[j][k];
      // Written so that NaN fails.
      if (!(pivot > 0.0))
        return;
      smallest_pivot_ = j == 0 || pivot < smallest_pivot_ ? pivot : smallest_pivot_;
      const double root = std::sqrt(pivot);
      inverse_[j] = 1.0 / root;
      for (int i = j + 1; i < n; ++i) {
        double sum = S(i, j);
        for (int k = 0; k < j; ++k)
          sum -= L_[i][k] * L_[j][k];
        L_[i][j] = sum * inverse_[j];
      }
    }
    is_positive_ = true;
  }

  /// Whether S is positive definite; else there is nothing to solve.
  bool isPositive() const
  {
    return is_positive_;
  }

  /// Square of the smallest diagonal entry of L; 0 when there is no L.
  double smallestPivot() const
  {
    return is_positive_ ? smallest_pivot_ : 0.0;
  }

  template <typename Derived>
  Vector solve(const Eigen::MatrixBase<Derived>& b) const
  {
    Vector x;
    for (int i = 0; i < n; ++i) {
      double sum = b[i];
      for (int k = 0; k < i; ++k)
        sum -= L_[i][k] * x[k];
      x[i] = sum * inverse_[i];
    }
    for (int i = n; i-- > 0;) {
      double sum = x[i];
      for (int k = i + 1; k < n; ++k)
        sum -= L_[k][i] * x[k];
      x[i] = sum * inverse_[i];
    }
    return x;
  }

  /// NaN when not positive definite.
  Matrix inverse() const
  {
    if (!is_positive_)
      return Matrix::Constant(std::numeric_limits<double>::quiet_NaN());
    double M[n][n] = {}; // of L
    for (int j = 0; j < n; ++j) {
      M[j][j] = inverse_[j];
      for (int i = j + 1; i < n; ++i) {
        double sum = 0.0;
        for (int k = j; k < i; ++k)
          sum += L_[i][k] * M[k][j];
        M[i][j] = -sum * inverse_[i];
      }
    }
    Matrix S;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) {
        double sum = 0.0;
        for (int k = i; k < n; ++k)
          sum += M[k][i] * M[k][j];
        S(i, j) = S(j, i) = sum;
      }
    return S;
  }

private:
  double L_[n][n]; // below the diagonal
  double inverse_[n]; // of the diagonal
  double smallest_pivot_ = 0.0;
  bool is_positive_ = false;
};

} // namespace holdfast
