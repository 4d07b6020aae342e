// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/regression/gauss_newton.hpp"

namespace axiscal {

/// Number of contiguous parts of a long recording. The jackknife has one degree of freedom less.
inline constexpr Eigen::Index jackknife_parts = 10;

/// Changes of a least-squares solution if each contiguous tenth of the rows in turn is left out, by
/// one step of Gauss-Newton. They include the effect of all correlation that is shorter than a
/// tenth.
///
/// @param at_solution  residuals and Jacobian at the solution, with rows in time order.
/// @return p x 10; a column is NaN if the other rows do not determine the unknowns.
/// @par Source
/// Kuensch, Annals of Statistics 17 (1989) 1217-1241 (the jackknife for dependent observations).
[[nodiscard]] Eigen::MatrixXd block_jackknife_changes(const Linearised& at_solution);

/// The standard uncertainties from block_jackknife_changes(), with 9 degrees of freedom.
/// @param changes  q x 10, of any q linear functions of the unknowns.
[[nodiscard]] Eigen::VectorXd jackknife_uncertainty(const Eigen::MatrixXd& changes);

/// @return the covariance rescaled to other standard uncertainties; its correlations, and rows of
///         variance 0, do not change.
[[nodiscard]] Eigen::MatrixXd rescaled_covariance(const Eigen::MatrixXd& covariance,
                                                  const Eigen::VectorXd& uncertainties);

/// The number of consecutive values that contain as much information as one independent value: 1 +
/// 2 sum of the autocorrelations, from the variance of means of 2, 4, 8, ... values. The work is
/// linear in n.
/// @param values  n, of mean 0.
/// @return 1 or more, and at most n / 8 for 8 values or more.
/// @par Source
/// Flyvbjerg & Petersen, J. Chem. Phys. 91 (1989) 461-466.
[[nodiscard]] double correlation_length(const Eigen::VectorXd& values);

}  // namespace axiscal
