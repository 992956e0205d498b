/// \file J S J^T of small matrices of any size up to sixteen.
#pragma once

#include "fit/kernel.h"

#include <Eigen/Core>

namespace holdfast {

/// Some rows as the kernel has them.
class SmallRows {
public:
  /// Zero.
  explicit SmallRows(int rows) : rows_(rows)
  {
    for (int i = 0; i < rows; ++i)
      for (double& entry : v_[i])
        entry = 0.0;
  }

  template <typename Derived>
  explicit SmallRows(const Eigen::MatrixBase<Derived>& M)
  : SmallRows(static_cast<int>(M.rows()))
  {
    for (int j = 0; j < M.cols(); ++j)
      for (int i = 0; i < rows_; ++i)
        v_[i][j] = M(i, j);
  }

  double& operator()(int i, int j)
  {
    return v_[i][j];
  }
  double operator()(int i, int j) const
  {
    return v_[i][j];
  }

  /// J S J^T of this J and a symmetric S; Eigen's products of matrices whose size it
  /// does not know go entry by entry.
  template <typename Result>
  Result congruence(const SmallRows& S) const
  {
    alignas(64) double product[kernel::kSmallRow][kernel::kSmallRow];
    kernel::kernel().congruence(v_[0], rows_, S.v_[0], S.rows_, product[0]);
    Result result(rows_, rows_);
    for (int i = 0; i < rows_; ++i)
      for (int j = 0; j <= i; ++j)
        result(i, j) = result(j, i) = product[i][j];
    return result;
  }

private:
  int rows_;
  alignas(64) double v_[kernel::kSmallRow][kernel::kSmallRow];
};

} // namespace holdfast
