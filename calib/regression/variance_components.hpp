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
  Eigen::MatrixXd W;       ///< n m x c; rows of zeros are left out
  Eigen::VectorXd y;       ///< n m
  Eigen::Index prior = 0;  ///< number of last columns whose coefficients are errors of variance 1
  std::vector<Eigen::MatrixXd> roots;  ///< q, n m rows: K_qi below each other, Q_qi = K_qi K_qi^T
  /// Sums of squares that depend on theta_q only, with their degrees of freedom; q entries, or
  /// empty.
  Eigen::VectorXd pure_squares;
  Eigen::VectorXd pure_degrees_of_freedom;
  Eigen::VectorXd smallest;  ///< q lower limits of the components
};

/// The estimate by restricted likelihood.
struct VarianceFit {
  Eigen::VectorXd theta;             ///< q variances
  Eigen::MatrixXd theta_covariance;  ///< q x q; 0 for components at their limit
  Eigen::MatrixXd information;  ///< A, q x q: the inverse of half the covariance of all components
  Eigen::VectorXd estimate;     ///< b, c entries
  Eigen::MatrixXd covariance;   ///< (W^T V^-1 W + prior)^-1, c x c
  std::vector<Eigen::MatrixXd> unit_shares;  ///< q: contribution of theta_q = 1 to b's covariance

  /// The part of b's covariance from the components, without the part from the prior.
  [[nodiscard]] Eigen::MatrixXd scatter() const;

  /// Satterthwaite's degrees of freedom of the variance of an entry of b in scatter(), at least 1.
  [[nodiscard]] double degrees_of_freedom(Eigen::Index entry) const;

  /// The same for the variance h^T theta of any quantity.
  /// @param h  q entries: contribution of theta_q = 1 to this variance.
  [[nodiscard]] double degrees_of_freedom_of(const Eigen::VectorXd& h) const;

  /// @return the degrees of freedom of a component: 2 theta^2 over its variance.
  [[nodiscard]] double component_degrees_of_freedom(Eigen::Index component) const;
};

/// Variance components by restricted maximum likelihood (REML), iterated by Fisher's scoring as
/// A theta = g, A_qr = tr(P Q_q P Q_r), g_q = y^T P Q_q P y; the work is linear in n.
///
/// @param start  q variances, positive.
/// @param still  relative change of the variances at which the iteration ends.
/// @return nullopt if the columns are not determined, or if it does not converge.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 11.1; Satterthwaite,
/// Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] std::optional<VarianceFit> fit_variance_components(const VarianceProblem& problem,
                                                                 const Eigen::VectorXd& start,
                                                                 double still = 1e-9);

/// The number of standard errors by which a component exceeds 0, by one step of scoring from 0 (its
/// score test). A component far below significance need not be fitted.
///
/// @param theta  q variances; that of the component is 0.
/// @return nullopt if the columns are not determined.
[[nodiscard]] std::optional<double> component_score(const VarianceProblem& problem,
                                                    const Eigen::VectorXd& theta,
                                                    Eigen::Index component);

/// The probability that variances differ this much by chance (Bartlett's test).
/// @return 1 if a variance has at most one degree of freedom.
/// @par Source
/// Bartlett, Proc. R. Soc. A 160 (1937) 268-282.
[[nodiscard]] double equal_variances_p(const Eigen::VectorXd& variances,
                                       const Eigen::VectorXd& degrees_of_freedom);

/// Generalised least squares at variances that are known.
struct WeightedFit {
  Eigen::VectorXd estimate;  ///< b, c entries
  double squares = 0.0;      ///< y^T P y; its mean is the rows minus the columns without a prior
};

/// @return nullopt if the columns are not determined.
[[nodiscard]] std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                                          const Eigen::VectorXd& theta);

}  // namespace axiscal
