// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include <Eigen/Core>

namespace axiscal {

/// Iteratively reweighted least squares: computes the weights and repeats the fit alternately,
/// until the weights converge.
///
/// @param rows, columns  size of the matrix of weights, which are 1 at the start.
/// @param weigh          returns the weights from the residuals of the last fit.
/// @param fit            repeats the fit with these weights.
/// @return the weights of the last fit, after at most 100 rounds.
Eigen::MatrixXd reweight_until_converged(Eigen::Index rows,
                                         Eigen::Index columns,
                                         const std::function<Eigen::MatrixXd()>& weigh,
                                         const std::function<void(const Eigen::MatrixXd&)>& fit);

}  // namespace axiscal
