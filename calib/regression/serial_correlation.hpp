// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Readings in time order with m responses. Each response has its own regression.
struct OrderedReadings {
  /// design matrices, n x p: one for each response, or one for all responses; the first column is 1
  std::vector<Eigen::MatrixXd> designs;
  Eigen::MatrixXd responses;  ///< n x m
  Eigen::VectorXd places;     ///< index of each reading in the run, n increasing integers
  /// block number of each reading, n entries; empty if there are no blocks. The readings of a block
  /// are consecutive.
  std::vector<int> blocks;

  [[nodiscard]] const Eigen::MatrixXd& design_of(Eigen::Index k) const {
    return designs[designs.size() == 1 ? 0 : static_cast<std::size_t>(k)];
  }
};

/// Readings count as correlated if lag_one_score() is above this limit (one-sided test at the 10 %
/// level).
inline constexpr double alike_above = 1.282;

/// A note reports the correlation if lag_one_score() is above this limit (one-sided test at the 1 %
/// level). Between the two limits the correlation may be due to chance: the confidence intervals
/// allow for the correlation, but no note reports it.
inline constexpr double told_alike_above = 2.326;

/// Computes a score of the correlation between the residuals of consecutive readings.
///
/// Each response's residuals e are scaled to variance 1, and the products e_i e_(i+1) of all
/// readings and responses are added. The score is this sum minus its mean for white noise, divided
/// by its standard deviation for white noise.
///
/// @return a number that is approximately standard normal for white noise; 0 if there are no
///         degrees of freedom.
/// @par Source
/// Moments of a ratio of quadratic forms: Durbin & Watson, Biometrika 37 (1950) 409-428.
[[nodiscard]] double lag_one_score(const OrderedReadings& readings);

/// Computes lag_one_score() for groups of responses. The responses of a group share one design.
class LagOneScore {
 public:
  /// Adds r responses that share one design.
  /// @param Q          n x p: an orthonormal basis of the design.
  /// @param residuals  residuals of the responses, n x r.
  template <typename Basis, typename Residuals>
  void add(const Basis& Q, const Residuals& residuals) {
    // Computes the traces of P A P and (P A P)^2 without n x n matrices. P is I - Q Q^T. Row i of
    // A x is half the sum of the rows i - 1 and i + 1 of x.
    const Eigen::Index n = Q.rows();
    const auto beside = [&](Eigen::Index i) {
      return 0.5 * ((i > 0 ? 1.0 : 0.0) * Q.row(std::max<Eigen::Index>(i - 1, 0)) +
                    (i + 1 < n ? 1.0 : 0.0) * Q.row(std::min(i + 1, n - 1)));
    };
    constexpr int columns = Basis::ColsAtCompileTime;
    using Row = Eigen::Matrix<double, 1, columns>;
    Eigen::Matrix<double, columns, columns> G =
        Eigen::Matrix<double, columns, columns>::Zero(Q.cols(), Q.cols());
    double squares_beside = 0.0;
    Row row(Q.cols());
    for (Eigen::Index i = 0; i < n; ++i) {
      row = beside(i);
      squares_beside += row.squaredNorm();
      G.noalias() += Q.row(i).transpose().lazyProduct(row);
    }
    const double trace = -G.trace();
    const double trace_of_square =
        0.5 * static_cast<double>(n - 1) - 2.0 * squares_beside + G.squaredNorm();
    const auto d = static_cast<double>(n - Q.cols());
    for (Eigen::Index k = 0; k < residuals.cols(); ++k) {
      const auto e = residuals.col(k);
      const double squares = e.squaredNorm();
      if (squares > 0.0 && d > 2.0) {
        products_ += d * e.head(n - 1).dot(e.tail(n - 1)) / squares;
        mean_ += trace;
        variance_ += 2.0 * (d * trace_of_square - trace * trace) / (d + 2.0);
        counted_ += 1.0;
      }
    }
  }

  // Returns the score of all added responses. Responses with residuals of 0, or with at most two
  // degrees of freedom, do not contribute; the score is 0 if no response contributes.
  [[nodiscard]] double value() const {
    return counted_ > 0.0 ? (products_ - mean_) / std::sqrt(variance_) : 0.0;
  }

 private:
  double products_ = 0.0;
  double mean_ = 0.0;
  double variance_ = 0.0;
  double counted_ = 0.0;
};

/// The uncertainty of the first coefficient of each response's regression, if the noise is the sum
/// of white noise and of noise that is correlated from reading to reading. The coefficients are
/// those of ordinary least squares.
struct CorrelatedMean {
  Eigen::VectorXd u;                ///< standard uncertainties, m entries
  Eigen::VectorXd u_if_white;       ///< the same without correlation, m entries
  double degrees_of_freedom = 0.0;  ///< n - p
  /// correlation of the noise of consecutive readings: a weighted mean over the noise models
  double correlation = 0.0;
};

/// Computes the uncertainty of the first coefficients b as a weighted mean over models of the noise
/// covariance V. The models are V_ij = rho^|i - j| + lambda I_ij. If there are blocks, further
/// models are V_ij = I_ij + gamma for readings i and j of the same block. The weight of a model is
/// its restricted likelihood times its prior. The priors of all models with the same rho sum to 1,
/// and so do the priors of all models with gamma. A Kalman filter applies V^-1/2, so the work is
/// linear in n.
///
/// For a model with the estimate b_g and the uncertainty u_g, the variance of b is
/// u_g^2 + (b_g - b)^2. b itself is not changed: if the bias wanders, b is close to the mean of the
/// bias over the run, and b_g is not.
///
/// @par Source
/// Harvey, Forecasting, Structural Time Series Models and the Kalman Filter (1989), sec. 3.4;
/// Hoeting et al., Statistical Science 14 (1999) 382-417 (averages over models).
[[nodiscard]] CorrelatedMean uncertainty_of_correlated_mean(const OrderedReadings& readings);

/// Computes lag_one_score() for one response whose noise is a component of three-axis noise. The
/// direction of this component changes from reading to reading. Each pair of consecutive readings
/// is weighted by the scalar product of its two directions.
/// @param design    n x p.
/// @param response  n entries.
/// @param along     h, n x 3: the direction of the component at each reading.
[[nodiscard]] double lag_one_score(const Eigen::MatrixXd& design,
                                   const Eigen::VectorXd& response,
                                   const Eigen::MatrixX3d& along);

/// The coefficients of a fit, averaged over models of correlated noise.
struct CorrelatedFit {
  Eigen::VectorXd estimate;         ///< the coefficients, p entries
  Eigen::MatrixXd covariance;       ///< covariance of the coefficients, p x p
  double degrees_of_freedom = 0.0;  ///< number of fitted rows minus p
  double correlation = 0.0;         ///< see CorrelatedMean::correlation
};

/// Fits y_i = J_i b + h_i . x_i + white noise. The noise x_i has three components; each component
/// has the correlation rho^|i - j| between the readings i and j. The direction h_i changes from
/// reading to reading. The models of the noise are those of
/// uncertainty_of_correlated_mean() without blocks, with rho up to 0.995. The work is linear in n.
///
/// @param design    J, n x p.
/// @param response  y, n entries.
/// @param along     h, n x 3: row i is the direction h_i.
/// @return b and its covariance.
[[nodiscard]] CorrelatedFit fit_with_correlated_noise(const Eigen::MatrixXd& design,
                                                      const Eigen::VectorXd& response,
                                                      const Eigen::MatrixX3d& along);

/// Computes the lag_one_score() of z = B e, where e contains the residuals of a larger fit and the
/// rows of B are orthonormal.
/// @param hat_root     K, n x q, with K K^T = B J (J^T J)^-1 J^T B^T; J is the Jacobian of the fit.
/// @param hat_squares  K^T K.
[[nodiscard]] double lag_one_score_along(const Eigen::VectorXd& z,
                                         const Eigen::MatrixXd& hat_root,
                                         const Eigen::MatrixXd& hat_squares);

/// A linear fit with m residuals for each reading. The residuals may have a common cause that
/// varies slowly from reading to reading. At reading i, the cause changes the m residuals along one
/// direction, in proportion to h_i.
struct CommonAr1Problem {
  Eigen::MatrixXd information;  ///< J^T J, q x q
  /// sum of squares of all residuals, which are orthogonal to J
  double squares = 0.0;
  const Eigen::MatrixXd& along;       ///< n x q: component of J along the direction of the cause
  const Eigen::VectorXd& deviations;  ///< n: component of the residuals along this direction
  Eigen::MatrixXd sizes;              ///< h, n x 1: factor h_i of each reading; mean square 1
  Eigen::VectorXd places;             ///< index of each reading in the run; see OrderedReadings
  double degrees_of_freedom = 0.0;    ///< number of residuals minus q
};

/// @return the change of the coefficients from the linear fit, and the covariance of the
///         coefficients. Both are means over models of the noise along the direction of the cause.
///         The covariance of this noise is V_ij = I_ij + lambda h_i h_j rho^|i - j|.
[[nodiscard]] CorrelatedFit fit_with_common_ar1(const CommonAr1Problem& problem);

}  // namespace axiscal
