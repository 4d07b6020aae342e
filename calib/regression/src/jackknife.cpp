// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/jackknife.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {

Eigen::MatrixXd block_jackknife_changes(const Linearised& at_solution) {
  const Eigen::Index n = at_solution.jacobian.rows();
  const Eigen::Index p = at_solution.jacobian.cols();
  // The columns are scaled to length 1 to reduce the rounding errors of J^T J.
  const Eigen::VectorXd lengths = at_solution.jacobian.colwise().norm();
  const Eigen::VectorXd per_length = (lengths.array() > 0.0).select(lengths.cwiseInverse(), 1.0);
  const Eigen::MatrixXd J = at_solution.jacobian * per_length.asDiagonal();
  const Eigen::MatrixXd all = J.transpose() * J;
  Eigen::MatrixXd changes(p, jackknife_parts);
  for (Eigen::Index part = 0; part < jackknife_parts; ++part) {
    const Eigen::Index first = n * part / jackknife_parts;
    const Eigen::Index rows = n * (part + 1) / jackknife_parts - first;
    const auto left_out = J.middleRows(first, rows);
    const PositiveFactor others(all - left_out.transpose() * left_out);
    constexpr double open_below = 1e-11;
    if (!others.is_determined(open_below)) {
      changes.col(part).setConstant(not_a_number);
      continue;
    }
    changes.col(part) =
        per_length.asDiagonal() *
        others.solve(left_out.transpose() * at_solution.residuals.segment(first, rows));
  }
  return changes;
}

Eigen::VectorXd jackknife_uncertainty(const Eigen::MatrixXd& changes) {
  const Eigen::MatrixXd deviations = changes.colwise() - changes.rowwise().mean();
  const auto parts = static_cast<double>(changes.cols());
  return ((parts - 1.0) / parts * deviations.rowwise().squaredNorm()).cwiseSqrt();
}

Eigen::MatrixXd rescaled_covariance(const Eigen::MatrixXd& covariance,
                                    const Eigen::VectorXd& uncertainties) {
  const Eigen::VectorXd now = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd factors = (now.array() > 0.0).select(uncertainties.cwiseQuotient(now), 1.0);
  return factors.asDiagonal() * covariance * factors.asDiagonal();
}

double correlation_length(const Eigen::VectorXd& values) {
  constexpr Eigen::Index fewest_means = 8;
  Eigen::VectorXd means = values;
  const double single = values.squaredNorm() / static_cast<double>(values.size());
  double length = 1.0;
  for (double together = 2.0; means.size() / 2 >= fewest_means && single > 0.0; together *= 2.0) {
    const Eigen::Index half = means.size() / 2;
    means = (0.5 * (means(Eigen::seqN(0, half, 2)) + means(Eigen::seqN(1, half, 2)))).eval();
    const double variance = means.squaredNorm() / static_cast<double>(half);
    length = std::max(length, together * variance / single);
  }
  return std::min(length, static_cast<double>(values.size()) / fewest_means);
}

}  // namespace axiscal
