// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// The loss of degrees of freedom if the noise of several responses is correlated.
///
/// The tests of single readings add squares of all responses as if these were independent. If R is
/// the correlation of their noise, such a sum has tr(R)^2 / tr(R^2) = m / d times the degrees of
/// freedom that it has for independent responses, d = tr(R^2) / m (Satterthwaite).
///
/// @param residuals           n x m, weighted.
/// @param degrees_of_freedom  nu of one response.
/// @return an estimate of d, from 1 to m: tr(R^2) / m of the residuals less (m - 1) / nu, which is
///         its mean by chance.
/// @par Source
/// method.md, section 5; Satterthwaite, Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] double dof_reduction_factor(const Eigen::MatrixXd& residuals,
                                          double degrees_of_freedom);

}  // namespace axiscal
