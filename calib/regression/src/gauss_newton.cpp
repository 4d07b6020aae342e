// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/gauss_newton.hpp"

#include <vector>

#include "calib/regression/factor.hpp"
#include "kernels/sums_of_products.hpp"

namespace axiscal {
namespace {

Eigen::VectorXd damped_step_by_qr(const Linearised& linear, double damping) {
  const Eigen::MatrixXd& J = linear.jacobian;
  if (damping == 0.0 && linear.open_below > 0.0) {
    const SingularValues svd = singular_values(J);
    const Eigen::Index rank = (svd.values.array() > linear.open_below).count();
    const Eigen::VectorXd along = svd.U.leftCols(rank).transpose() * linear.residuals;
    return -svd.V.leftCols(rank) * along.cwiseQuotient(svd.values.head(rank));
  }
  if (damping == 0.0) {
    const Factor qr(J);
    if (qr.has_full_rank()) {
      return -qr.solve(linear.residuals);
    }
  }
  const Eigen::Index n = J.rows();
  const Eigen::Index p = J.cols();
  const Eigen::VectorXd lengths = J.colwise().norm().cwiseMax(1e-300);
  const Eigen::VectorXd per_length =
      (lengths.array() > linear.open_below).select(lengths.cwiseInverse(), 0.0);
  Eigen::MatrixXd A(n + p, p);
  A << J * per_length.asDiagonal(), std::sqrt(damping) * Eigen::MatrixXd::Identity(p, p);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n + p);
  b.head(n) = -linear.residuals;
  return minimum_norm_solution(A, b).cwiseProduct(per_length);
}

}  // namespace

std::optional<Eigen::VectorXd> step_by_normal_equations(const Linearised& linear,
                                                        double damping,
                                                        double smallest_pivot) {
  const Eigen::Index p = linear.jacobian.cols();
  std::vector<const double*> columns;
  for (Eigen::Index j = 0; j < p; ++j) {
    columns.push_back(linear.jacobian.col(j).data());
  }
  columns.push_back(linear.residuals.data());
  Eigen::MatrixXd sums(p + 1, p + 1);
  sums_of_products(columns, static_cast<std::size_t>(linear.jacobian.rows()), sums.data());
  const Eigen::MatrixXd N = sums.topLeftCorner(p, p).selfadjointView<Eigen::Lower>();
  const PositiveFactor cholesky(N, damping);
  if (!cholesky.is_determined(smallest_pivot * smallest_pivot)) {
    return std::nullopt;
  }
  return Eigen::VectorXd(-cholesky.solve(sums.row(p).head(p).transpose()));
}

Eigen::VectorXd damped_step(const Linearised& linear, double damping, bool by_qr) {
  if (linear.jacobian.cols() == 0) {
    return Eigen::VectorXd(0);
  }
  // The relative error of a step from J^T J grows with the square of the condition number of J.
  // Such a step is used only if all pivots are above a limit, which is stricter if `by_qr` is true.
  constexpr double loses_some_digits = 1e-5;
  constexpr double loses_none_that_matters = 0.03;
  const bool is_open = linear.open_below > 0.0 &&
                       !(linear.jacobian.colwise().norm().array() > linear.open_below).all();
  if (is_open) {
    return damped_step_by_qr(linear, damping);
  }
  if (auto step = step_by_normal_equations(linear, damping,
                                           by_qr ? loses_none_that_matters : loses_some_digits)) {
    return *std::move(step);
  }
  return damped_step_by_qr(linear, damping);
}

}  // namespace axiscal
