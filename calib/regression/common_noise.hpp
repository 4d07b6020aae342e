// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// Estimates the factor by which the correlation between several responses reduces the degrees of
/// freedom of a test.
///
/// The tests of single readings add the squared residuals of all m responses. If the noise of the
/// responses is independent, this sum has m degrees of freedom. If it has the correlation matrix R,
/// the sum has m / d degrees of freedom, where d = tr(R^2) / m (Satterthwaite).
///
/// @param residuals           weighted residuals, n x m.
/// @param degrees_of_freedom  nu, the degrees of freedom of one response's residuals.
/// @return an estimate of d, limited to 1 .. m. It is tr(R^2) / m with R from the residuals, minus
///         the bias (m - 1) (1 - r^2)^2 / nu. r^2 is the mean square of the correlations in R.
/// @par Source
/// method.md, section 5; Satterthwaite, Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] double dof_reduction_factor(const Eigen::MatrixXd& residuals,
                                          double degrees_of_freedom);

}  // namespace axiscal
