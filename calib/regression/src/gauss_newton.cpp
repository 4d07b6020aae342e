// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/gauss_newton.hpp"

#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/calib/scaled_qr.hpp"

namespace axiscal {

Eigen::VectorXd damped_step_by_qr(const Eigen::MatrixXd& jacobian,
                                  const Eigen::VectorXd& residuals,
                                  double damping) {
  if (damping == 0.0) {
    const ScaledQr qr(jacobian);
    if (qr.has_full_rank()) {
      return -qr.solve(residuals);
    }
  }
  const Eigen::Index n = jacobian.rows();
  const Eigen::Index p = jacobian.cols();
  const Eigen::VectorXd lengths = jacobian.colwise().norm().cwiseMax(1e-300);
  Eigen::MatrixXd A(n + p, p);
  A << jacobian * lengths.cwiseInverse().asDiagonal(),
      std::sqrt(damping) * Eigen::MatrixXd::Identity(p, p);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n + p);
  b.head(n) = -residuals;
  return minimum_norm_solution(A, b).cwiseQuotient(lengths);
}

template Eigen::VectorXd damped_step<Eigen::Dynamic>(const Linearised<Eigen::Dynamic>&,
                                                     double,
                                                     bool);

}  // namespace axiscal
