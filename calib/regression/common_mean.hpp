// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// The common mean of several values. Each value is the sum of this mean, a random effect, and an
/// error with the value's stated uncertainty.
struct CommonMean {
  double mean = 0.0;
  double u = 0.0;  ///< standard uncertainty of the mean, from the scatter of the values
  /// standard uncertainty of the mean, from the stated uncertainties only
  double u_within = 0.0;
  double between = 0.0;                     ///< tau: standard deviation of the random effect
  double between_degrees_of_freedom = 1.0;  ///< degrees of freedom of tau^2; at least 1
  double p_value = 1.0;  ///< p-value of the chi^2 test that there is no random effect
};

/// @param x  the values, two or more.
/// @param u  standard uncertainties of the values, positive.
/// @par Source
/// Paule & Mandel, J. Res. NBS 87 (1982) 377-385; Hartung & Knapp, Stat. Med. 20 (2001) 3875-3889.
[[nodiscard]] CommonMean common_mean(const Eigen::VectorXd& x, const Eigen::VectorXd& u);

}  // namespace axiscal
