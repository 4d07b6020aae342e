// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/minimum_norm.hpp"

#include <Eigen/QR>

namespace axiscal {

Eigen::VectorXd minimum_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(A).solve(b);
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A) {
  return ranked_inverse(A).inverse;
}

RankedInverse ranked_inverse(const Eigen::MatrixXd& A) {
  const auto of = [](const auto& decomposition) {
    return RankedInverse{.inverse = decomposition.pseudoInverse(), .rank = decomposition.rank()};
  };
  if (A.rows() == 3 && A.cols() == 3) {  // three axes, the usual case, without an allocation
    return of(Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d>(A));
  }
  return of(Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(A));
}

}  // namespace axiscal
