// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Readings y = W b + e of n units with m rows each, one unit below the other. The rows of a unit
/// have the covariance V_i = sum_q theta_q Q_qi, those of different units nothing in common but
/// what the errors in b make.
struct VarianceProblem {
  Eigen::Index rows = 0;   ///< m
  Eigen::MatrixXd W;       ///< n m x c; rows of zeros are left out
  Eigen::VectorXd y;       ///< n m
  Eigen::Index prior = 0;  ///< the last of the columns are errors of mean 0 and variance 1
  std::vector<Eigen::MatrixXd> roots;  ///< q, n m rows: K_qi below each other, Q_qi = K_qi K_qi^T
  /// Sums of squares that say theta_q alone, with their degrees of freedom; q entries, or none.
  Eigen::VectorXd pure_squares;
  Eigen::VectorXd pure_degrees_of_freedom;
  Eigen::VectorXd smallest;  ///< q entries: no component is taken to be less
};

/// The estimate by restricted likelihood.
struct VarianceFit {
  Eigen::VectorXd theta;             ///< q variances
  Eigen::MatrixXd theta_covariance;  ///< q x q; 0 where one is at its smallest
  Eigen::MatrixXd information;  ///< A, q x q: the inverse of half the covariance of all components
  Eigen::VectorXd estimate;     ///< b, c entries
  Eigen::MatrixXd covariance;   ///< (W^T V^-1 W + prior)^-1, c x c
  std::vector<Eigen::MatrixXd> unit_shares;  ///< q: the contribution of theta = 1 to b's covariance

  /// The scatter's part of the covariance of b: without that of the prior.
  [[nodiscard]] Eigen::MatrixXd scatter() const;

  /// Satterthwaite's degrees of freedom of the scatter's variance of an entry of b, at least 1.
  [[nodiscard]] double degrees_of_freedom(Eigen::Index entry) const;

  /// As above, for any variance.
  /// @param h  q entries: the contribution of theta = 1.
  [[nodiscard]] double degrees_of_freedom_of(const Eigen::VectorXd& h) const;

  /// @return the degrees of freedom of a component: 2 theta^2 over its variance.
  [[nodiscard]] double component_degrees_of_freedom(Eigen::Index component) const;
};

/// Variance components by restricted maximum likelihood (REML), iterated by Fisher's scoring as
/// A theta = g, A_qr = tr(P Q_q P Q_r), g_q = y^T P Q_q P y; the work is linear in n.
///
/// @param start  q variances, positive.
/// @param still  relative change of the variances that ends it.
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

/// How likely variances differ so much by chance, each known with its degrees of freedom.
/// @return 1 where one has too few to tell.
/// @par Source
/// Bartlett, Proc. R. Soc. A 160 (1937) 268-282.
[[nodiscard]] double equal_variances_p(const Eigen::VectorXd& variances,
                                       const Eigen::VectorXd& degrees_of_freedom);

/// Generalised least squares at variances that are known.
struct WeightedFit {
  Eigen::VectorXd estimate;  ///< b, c entries
  double squares = 0.0;      ///< y^T P y: about the rows less the columns without a prior
};

/// @return nullopt if the columns are not determined.
[[nodiscard]] std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                                          const Eigen::VectorXd& theta);

}  // namespace axiscal
