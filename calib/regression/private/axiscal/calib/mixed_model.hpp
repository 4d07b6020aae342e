// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

namespace axiscal {

/// The unknowns of y = W x + e, e ~ N(0, 1), the last q of x ~ N(0, 1): p fixed effects and q
/// random ones, which have a prior.
struct MixedModelFit {
  Eigen::VectorXd estimate;    ///< p + q
  Eigen::MatrixXd covariance;  ///< covers all of them
  Eigen::VectorXd residuals;   ///< y - W x, n
};

/// @param W       n x (p + q), in units of the noise.
/// @param random  q.
/// @return nothing where rows and prior do not determine all unknowns.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), sec. 7.6.
[[nodiscard]] std::optional<MixedModelFit> fit_mixed_model(const Eigen::MatrixXd& W,
                                                           const Eigen::VectorXd& y,
                                                           Eigen::Index random);

}  // namespace axiscal
