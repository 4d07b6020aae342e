// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// The factor by which correlated noise of several responses reduces degrees of freedom.
///
/// The tests of single readings add squares of all responses as if these were independent. If R is
/// the correlation of their noise, a sum over all m responses has tr(R)^2 / tr(R^2) = m / d degrees
/// of freedom instead of m, with d = tr(R^2) / m (Satterthwaite).
///
/// @param residuals           n x m, weighted.
/// @param degrees_of_freedom  nu of one response.
/// @return an estimate of d, from 1 to m: tr(R^2) / m of the residuals, minus its mean excess by
///         chance, (m - 1) / nu.
/// @par Source
/// method.md, section 5; Satterthwaite, Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] double dof_reduction_factor(const Eigen::MatrixXd& residuals,
                                          double degrees_of_freedom);

}  // namespace axiscal
