// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/further_columns.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {

std::optional<FurtherColumns> fit_further_columns(const Eigen::MatrixXd& design,
                                                  const Eigen::VectorXd& residuals,
                                                  const Eigen::MatrixXd& columns,
                                                  double alike,
                                                  double open_below) {
  const Eigen::Index p = design.cols();
  const Eigen::Index q = columns.cols();
  const auto free = static_cast<double>(design.rows() - p - q);
  if (!(free >= 1.0)) {
    return std::nullopt;
  }
  Eigen::MatrixXd both(design.rows(), p + q);
  both << design, columns;
  const Factor qr(both, open_below);
  if (!qr.has_full_rank()) {
    return std::nullopt;
  }
  const Eigen::VectorXd all = qr.solve(residuals);
  const double squares = (residuals - both * all).squaredNorm();
  const double drop = std::max(residuals.squaredNorm() - squares, 0.0);
  const double F = drop / static_cast<double>(q) / (squares / free) / alike;
  return FurtherColumns{.estimate = all.tail(q),
                        .change = all.head(p),
                        .covariance = qr.covariance(),
                        .residual_sd = std::sqrt(squares / free),
                        .degrees_of_freedom = free,
                        .p_value = f_upper_p(std::max(F, 1e-300), static_cast<double>(q),
                                             std::max(free / alike, 1.0))};
}

}  // namespace axiscal
