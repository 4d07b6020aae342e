// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// The factor by which correlated noise of several responses reduces degrees of freedom.
///
/// The tests of single readings add the squared residuals of all m responses. If R is the
/// correlation matrix of the responses' noise, the sum has tr(R)^2 / tr(R^2) = m / d degrees of
/// freedom instead of m, with d = tr(R^2) / m (Satterthwaite).
///
/// @param residuals           weighted residuals, n x m.
/// @param degrees_of_freedom  nu, the degrees of freedom of one response's residuals.
/// @return an estimate of d, from 1 to m: tr(R^2) / m from the residuals, minus (m - 1) / nu, its
///         mean excess for independent noise.
/// @par Source
/// method.md, section 5; Satterthwaite, Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] double dof_reduction_factor(const Eigen::MatrixXd& residuals,
                                          double degrees_of_freedom);

}  // namespace axiscal
