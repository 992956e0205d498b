/// \file J S J^T of small matrices of any size up to sixteen.
#pragma once

#include <Eigen/Core>

namespace holdfast {

/// Rows of sixteen numbers, so that a compiler takes them in whole vectors; Eigen's
/// products of matrices whose size it does not know go entry by entry.
class SmallRows {
public:
  static constexpr int kMost = 16;

  /// Zero.
  SmallRows() = default;

  template <typename Derived>
  explicit SmallRows(const Eigen::MatrixBase<Derived>& M)
  {
    for (Eigen::Index i = 0; i < M.rows(); ++i)
      for (Eigen::Index j = 0; j < M.cols(); ++j)
        v_[i][j] = M(i, j);
  }

  double& operator()(int i, int j)
  {
    return v_[i][j];
  }

  /// The first n rows of this times m rows of B.
  SmallRows times(int n, int m, const SmallRows& B) const
  {
    SmallRows product;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < m; ++k)
        for (int j = 0; j < kMost; ++j)
          product.v_[i][j] += v_[i][k] * B.v_[k][j];
    return product;
  }

  /// J S J^T of the first n rows of J, this, and a symmetric S of size m.
  template <typename Result>
  Result congruence(int n, int m, const SmallRows& S) const
  {
    const SmallRows JS = times(n, m, S);
    Result result(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) {
        double sum = 0.0;
        for (int k = 0; k < m; ++k)
          sum += JS.v_[i][k] * v_[j][k];
        result(i, j) = result(j, i) = sum;
      }
    return result;
  }

private:
  alignas(64) double v_[kMost][kMost] = {};
};

} // namespace holdfast
