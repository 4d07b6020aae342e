// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/scaled_cholesky.hpp"

namespace axiscal {

ScaledCholesky::ScaledCholesky(const Eigen::MatrixXd& normal, double damping)
    : per_length_(normal.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse()) {
  Eigen::MatrixXd scaled = per_length_.asDiagonal() * normal * per_length_.asDiagonal();
  scaled.diagonal().array() += damping;
  cholesky_.compute(scaled);
}

bool ScaledCholesky::is_determined(double open_below) const {
  return cholesky_.info() == Eigen::Success &&
         (cholesky_.matrixLLT().diagonal().array().square() > open_below).all();
}

Eigen::VectorXd ScaledCholesky::solve(const Eigen::VectorXd& right) const {
  return per_length_.cwiseProduct(cholesky_.solve(per_length_.cwiseProduct(right)));
}

Eigen::MatrixXd ScaledCholesky::inverse() const {
  const Eigen::Index p = per_length_.size();
  return per_length_.asDiagonal() * cholesky_.solve(Eigen::MatrixXd::Identity(p, p)) *
         per_length_.asDiagonal();
}

Eigen::MatrixXd ScaledCholesky::root_of_inverse() const {
  const Eigen::Index p = per_length_.size();
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(p, p);
  cholesky_.matrixU().solveInPlace(root);
  return per_length_.asDiagonal() * root;
}

double ScaledCholesky::log_determinant() const {
  return 2.0 * (cholesky_.matrixLLT().diagonal().array() / per_length_.array()).log().sum();
}

}  // namespace axiscal
