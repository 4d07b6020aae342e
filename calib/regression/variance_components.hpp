// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// The model y = W b + e for the readings of n units. Each unit has m rows, and the rows of all
/// units are stacked. Within unit i, e has the covariance V_i = sum_q theta_q Q_qi, where q runs
/// over the components. The errors e of different units are independent. Errors that several units
/// share are coefficients in b (see `prior`).
struct VarianceProblem {
  Eigen::Index rows = 0;  ///< m, the number of rows of each unit
  Eigen::MatrixXd W;      ///< n m x c; a row that is left out is 0 in W, y and `roots`
  Eigen::VectorXd y;      ///< the readings, n m entries
  /// number of columns at the end of W whose coefficients are errors of variance 1
  Eigen::Index prior = 0;
  /// For each component q, a matrix with n m rows. It contains K_qi of all units i, one below the
  /// other, where Q_qi = K_qi K_qi^T.
  std::vector<Eigen::MatrixXd> roots;
  /// For each component q, a further sum of squares and its degrees of freedom. The expected value
  /// of the sum is theta_q times the degrees of freedom. Both vectors are empty if there are no
  /// such sums.
  Eigen::VectorXd pure_squares;
  Eigen::VectorXd pure_degrees_of_freedom;
  Eigen::VectorXd smallest;  ///< lower limit of each theta_q; empty: 0
};

/// The estimate by restricted likelihood.
struct VarianceFit {
  Eigen::VectorXd theta;             ///< the variance theta_q of each component
  Eigen::MatrixXd theta_covariance;  ///< covariance of theta; 0 for components at their limit
  /// A of the last round; 2 A^-1 is the covariance of components above their limit
  Eigen::MatrixXd information;
  Eigen::VectorXd estimate;  ///< b, c entries
  /// c x c: the covariance of b, (W^T V^-1 W + D)^-1; D is diagonal, with 1 for each column with
  /// a prior and 0 for each other column
  Eigen::MatrixXd covariance;
  /// for each component q, its contribution to the covariance of b, divided by theta_q; c x c
  std::vector<Eigen::MatrixXd> unit_shares;

  /// Returns the part of the covariance of b that the components cause, without the part that the
  /// prior causes.
  [[nodiscard]] Eigen::MatrixXd scatter() const;

  /// Returns Satterthwaite's degrees of freedom of a diagonal entry of scatter(), which is the
  /// variance of one entry of b; at least 1.
  [[nodiscard]] double degrees_of_freedom(Eigen::Index entry) const;

  /// Returns Satterthwaite's degrees of freedom of a variance that is the linear combination
  /// h^T theta; at least 1.
  /// @param h  for each component q, the factor of theta_q in this variance.
  [[nodiscard]] double degrees_of_freedom_of(const Eigen::VectorXd& h) const;

  /// @return the degrees of freedom of a component: 2 theta_q^2 divided by the variance of theta_q.
  [[nodiscard]] double component_degrees_of_freedom(Eigen::Index component) const;
};

/// Estimates the variance components theta by restricted maximum likelihood (REML). Each round of
/// Fisher's scoring solves A theta = g with A_qr = tr(P Q_q P Q_r) and g_q = y^T P Q_q P y. Here
/// P = V^-1 - V^-1 W C W^T V^-1, and C is the covariance of b. The work is linear in n.
///
/// @param start  positive variances, one for each component.
/// @param still  the iteration ends if the relative change of each variance is at most this number.
/// @return nullopt if the readings do not determine b, or if the iteration does not converge.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 11.1; Satterthwaite,
/// Biometrics Bulletin 2 (1946) 110-114.
[[nodiscard]] std::optional<VarianceFit> fit_variance_components(const VarianceProblem& problem,
                                                                 const Eigen::VectorXd& start,
                                                                 double still = 1e-9);

/// Computes a score that tests whether the variance of a component is greater than 0. It is the
/// first step of Fisher's scoring from `theta`, where this variance is 0, divided by the standard
/// error of the step. A component with a low score need not be fitted.
///
/// @param theta  the variance of each component; theta(component) is 0.
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
  /// y^T V^-1 (y - W b); its expected value is the number of rows minus the number of columns
  /// without prior
  double squares = 0.0;
};

/// Computes the generalised least-squares fit for given variances.
/// @param theta  the variance of each component.
/// @return nullopt if the readings do not determine b.
[[nodiscard]] std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                                          const Eigen::VectorXd& theta);

}  // namespace axiscal
