/// \file Eigenvalues of symmetric matrices of any size, for all that is not on the hot
/// path: Eigen's solver costs seconds per size and file to compile.
#pragma once

#include <Eigen/Core>

namespace holdfast {

struct SymmetricEigen {
  Eigen::VectorXd values; ///< ascending
  Eigen::MatrixXd vectors; ///< of unit length, in columns
};

SymmetricEigen symmetricEigen(const Eigen::MatrixXd& A);

} // namespace holdfast
