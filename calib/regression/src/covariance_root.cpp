// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/covariance_root.hpp"

#include <Eigen/Eigenvalues>

namespace axiscal {

Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace axiscal
