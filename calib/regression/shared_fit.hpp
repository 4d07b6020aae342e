// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// The sums that fit_shared() needs from the readings of one response. All responses have D
/// coefficients in common, and each response also has coefficients of its own. P contains the
/// columns of the common coefficients, and y the readings. Both are projected onto the orthogonal
/// complement of the response's own columns.
struct ResponseSums {
  Eigen::MatrixXd information;      ///< P^T P, D x D
  Eigen::VectorXd gradient;         ///< P^T y, D
  double squares = 0.0;             ///< y^T y
  double degrees_of_freedom = 0.0;  ///< N: number of readings minus number of own coefficients
};

/// The shared coefficients, if each response has its own variance.
struct SharedFit {
  Eigen::VectorXd variance;  ///< m variances of the responses
  /// nu, the degrees of freedom of each response, m entries: N minus the number of shared
  /// coefficients that are attributed to this response. This number need not be an integer.
  Eigen::VectorXd degrees_of_freedom;
  Eigen::VectorXd estimate;    ///< D shared coefficients
  Eigen::MatrixXd covariance;  ///< D x D
};

/// Estimates the responses' variances sigma_k^2 by restricted likelihood (REML), and the shared
/// coefficients. With u_k = ln sigma_k^2, Newton's method in u minimises
///
///     sum_k (N_k u_k + RSS_k e^-u_k) + ln det sum_k P_k^T P_k e^-u_k
///
/// At the minimum, sigma_k^2 = RSS_k / nu_k.
///
/// @param start     m variances at which the search starts.
/// @param smallest  m lower limits of the variances: the size of rounding errors.
/// @return nullopt if the readings do not determine the shared coefficients.
/// @par Source
/// Patterson & Thompson, Biometrika 58 (1971) 545-554; Searle, Casella & McCulloch, Variance
/// Components (1992), sec. 6.6.
[[nodiscard]] std::optional<SharedFit> fit_shared(const std::vector<ResponseSums>& responses,
                                                  const Eigen::VectorXd& start,
                                                  const Eigen::VectorXd& smallest);

}  // namespace axiscal
