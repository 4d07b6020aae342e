// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Readings y = W b + e of n units with m rows each, one unit below the other. The rows of a unit
/// have the covariance V_i = sum_q theta_q Q_qi, and the rows of different units are independent,
/// except for the errors in b.
struct VarianceProblem {
  Eigen::Index rows = 0;   ///< m
  Eigen::MatrixXd W;       ///< n m x c; a row that is left out is 0 in W, y and roots
  Eigen::VectorXd y;       ///< n m
  Eigen::Index prior = 0;  ///< number of last columns whose coefficients are errors of variance 1
  /// For each component q, a matrix with n m rows: K_q1, K_q2, ... stacked; Q_qi = K_qi K_qi^T.
  std::vector<Eigen::MatrixXd> roots;
  /// For each component q, a further sum of squares whose expected value is theta_q times its
  /// degrees of freedom; both vectors are empty if there are no such sums.
  Eigen::VectorXd pure_squares;
  Eigen::VectorXd pure_degrees_of_freedom;
  Eigen::VectorXd smallest;  ///< q lower limits of the components
};

/// The estimate by restricted likelihood.
struct VarianceFit {
  Eigen::VectorXd theta;             ///< q variances
  Eigen::MatrixXd theta_covariance;  ///< q x q; 0 for components at their limit
  Eigen::MatrixXd information;       ///< A, q x q; the covariance of free components is 2 A^-1
  Eigen::VectorXd estimate;          ///< b, c entries
  Eigen::MatrixXd covariance;        ///< (W^T V^-1 W + prior)^-1, c x c
  /// For each component q, the contribution of theta_q = 1 to the covariance of b, c x c.
  std::vector<Eigen::MatrixXd> unit_shares;

  /// The part of b's covariance from the components, without the part from the prior.
  [[nodiscard]] Eigen::MatrixXd scatter() const;

  /// Satterthwaite's degrees of freedom of the variance of an entry of b in scatter(), at least 1.
  [[nodiscard]] double degrees_of_freedom(Eigen::Index entry) const;

  /// Satterthwaite's degrees of freedom of the variance h^T theta of a quantity, at least 1.
  /// @param h  contribution of theta_q = 1 to this variance, for each component q.
  [[nodiscard]] double degrees_of_freedom_of(const Eigen::VectorXd& h) const;

  /// @return the degrees of freedom of a component: 2 theta_q^2 divided by the variance of theta_q.
  [[nodiscard]] double component_degrees_of_freedom(Eigen::Index component) const;
};

/// Variance components by restricted maximum likelihood (REML), iterated by Fisher's scoring as
/// A theta = g, A_qr = tr(P Q_q P Q_r), g_q = y^T P Q_q P y; the work is linear in n.
///
/// @param start  q variances, positive.
/// @param still  the iteration ends if no variance changes by more than this part of itself.
/// @return nullopt if the readings do not determine b, or if the iteration does not converge.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 11.1; Satterthwaite,
/// Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] std::optional<VarianceFit> fit_variance_components(const VarianceProblem& problem,
                                                                 const Eigen::VectorXd& start,
                                                                 double still = 1e-9);

/// The score test of a component: the number of standard errors by which the component exceeds 0,
/// from one step of scoring that starts at 0. A component with a low score need not be fitted.
///
/// @param theta  q variances; theta(component) is 0.
/// @return nullopt if the readings do not determine b or the components.
[[nodiscard]] std::optional<double> component_score(const VarianceProblem& problem,
                                                    const Eigen::VectorXd& theta,
                                                    Eigen::Index component);

/// Bartlett's test of equal variances.
/// @return the p-value; 1 for fewer than two variances, or if a variance has at most one degree of
///         freedom.
/// @par Source
/// Bartlett, Proc. R. Soc. A 160 (1937) 268-282.
[[nodiscard]] double equal_variances_p(const Eigen::VectorXd& variances,
                                       const Eigen::VectorXd& degrees_of_freedom);

/// The result of generalised least squares with known variances.
struct WeightedFit {
  Eigen::VectorXd estimate;  ///< b, c entries
  double squares = 0.0;      ///< y^T P y; expected value: rows minus columns without a prior
};

/// @return nullopt if the readings do not determine b.
[[nodiscard]] std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                                          const Eigen::VectorXd& theta);

}  // namespace axiscal
