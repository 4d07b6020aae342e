// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

namespace axiscal {

/// Tests whether further columns of a fit are significant, and gives their effect on it.
struct FurtherColumns {
  Eigen::VectorXd estimate;         ///< q, of the further columns
  Eigen::VectorXd change;           ///< p, of the fit's own coefficients
  Eigen::MatrixXd covariance;       ///< (p + q) x (p + q), unscaled
  double residual_sd = 0.0;         ///< with the further columns
  double degrees_of_freedom = 0.0;  ///< n - p - q
  /// probability of this improvement by chance, by F(q, n - p - q)
  double p_value = 1.0;
};

/// @param design     J, n x p.
/// @param residuals  n, of the fit.
/// @param columns    n x q.
/// @param alike      how many consecutive residuals count as one; 1: they are independent.
/// @param open_below  a column is dependent if less than this part remains after projection off the
///                    others.
/// @return nullopt if the columns depend on the fit's columns, or if too few rows remain.
[[nodiscard]] std::optional<FurtherColumns> fit_further_columns(const Eigen::MatrixXd& design,
                                                                const Eigen::VectorXd& residuals,
                                                                const Eigen::MatrixXd& columns,
                                                                double alike = 1.0,
                                                                double open_below = 1e-12);

}  // namespace axiscal
