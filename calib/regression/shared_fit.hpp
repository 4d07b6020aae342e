// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

namespace axiscal {

/// The sums that fit_shared() needs from the readings of m responses. All responses have D
/// coefficients in common, and each response also has coefficients of its own. P_k contains the
/// columns of the common coefficients, and y_k the readings of response k. Both are projected onto
/// the orthogonal complement of the response's own columns.
struct SharedSums {
  SharedSums() = default;
  SharedSums(Eigen::Index shared, Eigen::Index responses)
      : information(shared * shared, responses),
        gradient(shared, responses),
        squares(responses),
        degrees_of_freedom(responses) {}

  [[nodiscard]] Eigen::Index shared() const { return gradient.rows(); }
  [[nodiscard]] Eigen::Index responses() const { return gradient.cols(); }

  /// @return P_k^T P_k, D x D, a view of `information`.
  [[nodiscard]] auto information_of(Eigen::Index k) {
    return information.col(k).reshaped(shared(), shared());
  }
  [[nodiscard]] auto information_of(Eigen::Index k) const {
    return information.col(k).reshaped(shared(), shared());
  }

  /// @param weight  m weights, one for each response.
  /// @return the weighted sum of P_k^T P_k, D x D.
  [[nodiscard]] Eigen::MatrixXd information_at(const Eigen::VectorXd& weight) const {
    return (information * weight).reshaped(shared(), shared());
  }

  Eigen::MatrixXd information;  ///< P_k^T P_k in column k, D^2 x m
  Eigen::MatrixXd gradient;     ///< P_k^T y_k in column k, D x m
  Eigen::VectorXd squares;      ///< y_k^T y_k, m entries
  Eigen::VectorXd
      degrees_of_freedom;  ///< N_k: number of readings minus own coefficients, m entries
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
/// @param accuracy  the search ends if the relative errors of the variances are below this.
/// @return nullopt if the readings do not determine the shared coefficients.
/// @par Source
/// Patterson & Thompson, Biometrika 58 (1971) 545-554; Searle, Casella & McCulloch, Variance
/// Components (1992), sec. 6.6.
[[nodiscard]] std::optional<SharedFit> fit_shared(const SharedSums& sums,
                                                  const Eigen::VectorXd& start,
                                                  const Eigen::VectorXd& smallest,
                                                  double accuracy = 1e-12);

}  // namespace axiscal
