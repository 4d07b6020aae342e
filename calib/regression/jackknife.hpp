// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/regression/gauss_newton.hpp"

namespace axiscal {

/// Number of contiguous parts of a long recording; it gives one degree of freedom less.
inline constexpr Eigen::Index jackknife_parts = 10;

/// Changes of a least-squares solution when each contiguous tenth of the rows is left out, by one
/// step. Correlation shorter than a tenth is included, of any kind.
///
/// @param at_solution  residuals and Jacobian there, rows in the order in which they were taken; 9
///                     rows of a tenth or more for each unknown.
/// @return p x 10; NaN where the others do not determine the unknowns.
/// @par Source
/// Kuensch, Annals of Statistics 17 (1989) 1217-1241 (the jackknife for dependent observations).
[[nodiscard]] Eigen::MatrixXd block_jackknife_changes(const Linearised& at_solution);

/// The standard uncertainties that such changes say, with 9 degrees of freedom.
/// @param changes  q x 10, of any q linear functions of the unknowns.
[[nodiscard]] Eigen::VectorXd jackknife_uncertainty(const Eigen::MatrixXd& changes);

/// @return the covariance with other standard uncertainties, its correlations kept; rows of
///         variance 0 stay.
[[nodiscard]] Eigen::MatrixXd rescaled_covariance(const Eigen::MatrixXd& covariance,
                                                  const Eigen::VectorXd& uncertainties);

/// The number of consecutive values that have the information of one independent value: 1 + 2 sum
/// of the autocorrelations, from the variance of means of 2, 4, 8, ... values. The work is linear
/// in n.
/// @param values  n, of mean 0.
/// @return 1 or more, at most n / 8 (of 8 values or more).
/// @par Source
/// Flyvbjerg & Petersen, J. Chem. Phys. 91 (1989) 461-466.
[[nodiscard]] double correlation_length(const Eigen::VectorXd& values);

}  // namespace axiscal
