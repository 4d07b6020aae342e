// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/regression/gauss_newton.hpp"

namespace axiscal {

/// Number of contiguous parts into which the jackknife divides a recording. The resulting
/// uncertainties have jackknife_parts - 1 degrees of freedom.
inline constexpr Eigen::Index jackknife_parts = 10;

/// Divides the rows into ten contiguous parts. For each part, one Gauss-Newton step gives the
/// change of a least-squares solution if this part is left out. The changes include the effect of
/// correlations that are shorter than one part.
///
/// @param at_solution  residuals and Jacobian at the solution, with rows in time order.
/// @return the changes, p x 10: one column for each part. A column is NaN if the remaining rows do
///         not determine the unknowns.
/// @par Source
/// Kuensch, Annals of Statistics 17 (1989) 1217-1241 (the jackknife for dependent observations).
[[nodiscard]] Eigen::MatrixXd block_jackknife_changes(const Linearised& at_solution);

/// Computes standard uncertainties, with 9 degrees of freedom, from the changes that
/// block_jackknife_changes() returns.
/// @param changes  changes of q linear functions of the unknowns, q x 10.
/// @return q standard uncertainties.
[[nodiscard]] Eigen::VectorXd jackknife_uncertainty(const Eigen::MatrixXd& changes);

/// @return the covariance, rescaled so that its standard uncertainties are `uncertainties`. The
///         correlations, and rows of variance 0, do not change.
[[nodiscard]] Eigen::MatrixXd rescaled_covariance(const Eigen::MatrixXd& covariance,
                                                  const Eigen::VectorXd& uncertainties);

/// Estimates how many consecutive values contain as much information as one independent value. This
/// number is 1 plus twice the sum of the autocorrelations. It is computed from the variances of
/// means of 2, 4, 8, ... values. The work is linear in n.
/// @param values  n values with mean 0.
/// @return the number, at least 1 and at most n / 8; n / 8 if n is less than 8.
/// @par Source
/// Flyvbjerg & Petersen, J. Chem. Phys. 91 (1989) 461-466.
[[nodiscard]] double correlation_length(const Eigen::VectorXd& values);

}  // namespace axiscal
