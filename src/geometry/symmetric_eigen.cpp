#include "symmetric_eigen.h"

#include <Eigen/Eigenvalues>

namespace holdfast {

SymmetricEigen
symmetricEigen(const Eigen::MatrixXd& A)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

} // namespace holdfast
