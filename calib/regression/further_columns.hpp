// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

namespace axiscal {

/// The result of adding columns to a fit: their coefficients, their effect on the fit, and their
/// significance.
struct FurtherColumns {
  Eigen::VectorXd estimate;         ///< coefficients of the further columns, q entries
  Eigen::VectorXd change;           ///< change of the fit's own coefficients, p entries
  Eigen::MatrixXd covariance;       ///< (A^T A)^-1 with A = [design, columns], (p + q) x (p + q)
  double residual_sd = 0.0;         ///< residual sd of the fit with the further columns
  double degrees_of_freedom = 0.0;  ///< n - p - q
  /// p-value of the F test of the hypothesis that all further coefficients are 0
  double p_value = 1.0;
};

/// Adds columns to a linear fit, and tests by an F test whether their coefficients are 0.
///
/// @param design      J, the columns of the fit, n x p.
/// @param residuals   residuals of the fit, n entries.
/// @param columns     the further columns, n x q.
/// @param alike       number of consecutive residuals that count as one independent residual.
/// @param open_below  a column counts as dependent if its pivot is below `open_below` times the
///                    largest pivot.
/// @return nullopt if the columns depend on the fit's columns, or if too few rows remain.
[[nodiscard]] std::optional<FurtherColumns> fit_further_columns(const Eigen::MatrixXd& design,
                                                                const Eigen::VectorXd& residuals,
                                                                const Eigen::MatrixXd& columns,
                                                                double alike = 1.0,
                                                                double open_below = 1e-12);

}  // namespace axiscal
