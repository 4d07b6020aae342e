// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Readings in the order in which they were taken, m responses of one regression each.
struct OrderedReadings {
  std::vector<Eigen::MatrixXd> designs;  ///< m of n x p, or one for all; the first column is 1
  Eigen::MatrixXd responses;             ///< n x m
  Eigen::VectorXd places;   ///< n, increasing: the reading's number in the run, whole numbers
  std::vector<int> blocks;  ///< n, the readings of one block together; empty: there are none

  [[nodiscard]] const Eigen::MatrixXd& design_of(Eigen::Index k) const {
    return designs[designs.size() == 1 ? 0 : static_cast<std::size_t>(k)];
  }
};

/// Readings count as alike where a lag_one_score() is above this: one-sided 10 %.
inline constexpr double alike_above = 1.282;

/// A note says that readings are alike if a lag_one_score() is above this: one-sided 1 %. Below it
/// the intervals count what may be chance.
inline constexpr double told_alike_above = 2.326;

/// The correlation between residuals of consecutive readings.
///
/// The sum over the responses of sum e_i e_(i+1) / sum e^2, each response's residuals first divided
/// by their standard deviation, less its mean, over its standard deviation for white noise.
///
/// @return a number that is approximately standard normal for white noise; 0 without degrees of
///         freedom.
/// @par Source
/// Moments of a ratio of quadratic forms: Durbin & Watson, Biometrika 37 (1950) 409-428.
[[nodiscard]] double lag_one_score(const OrderedReadings& readings);

/// A lag_one_score() as it is summed over responses, one design after the other.
class LagOneScore {
 public:
  /// Takes responses of one design.
  /// @param Q          n x p: an orthonormal basis of the design.
  /// @param residuals  n x r.
  template <typename Basis, typename Residuals>
  void add(const Basis& Q, const Residuals& residuals) {
    // Q' = P A P with P = I - Q Q^T and A the mean of both neighbours: its trace and that of its
    // square, without any n x n.
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

  // Each response's residuals are of the variance 1, so that their sums of squares are d.
  [[nodiscard]] double value() const {
    return counted_ > 0.0 ? (products_ - mean_) / std::sqrt(variance_) : 0.0;
  }

 private:
  double products_ = 0.0;
  double mean_ = 0.0;
  double variance_ = 0.0;
  double counted_ = 0.0;
};

/// The first coefficient of each regression where the noise may be correlated from reading to
/// reading and white besides.
struct CorrelatedMean {
  Eigen::VectorXd estimate;         ///< m
  Eigen::VectorXd u;                ///< m standard uncertainties
  double degrees_of_freedom = 0.0;  ///< n - p
  double correlation = 0.0;         ///< mean correlation from reading to reading, by the weights
};

/// The mean over models V = rho^|i - j| + lambda I, and where there are blocks V = I + gamma within
/// each, weighted by their restricted likelihood and a prior that gives each rho, and all gammas
/// together, the same weight. V's root by the Kalman filter, so linear in the readings.
///
/// @par Source
/// Harvey, Forecasting, Structural Time Series Models and the Kalman Filter (1989), sec. 3.4;
/// Hoeting et al., Statistical Science 14 (1999) 382-417 (averages over models).
[[nodiscard]] CorrelatedMean estimate_correlated_mean(const OrderedReadings& readings);

/// As above, for one response with the noise of three axes along a changing direction. Each pair of
/// neighbours is weighted by the product of their directions.
/// @param design  n x p.
/// @param along   h, n x 3, as of fit_with_correlated_noise().
[[nodiscard]] double lag_one_score(const Eigen::MatrixXd& design,
                                   const Eigen::VectorXd& response,
                                   const Eigen::MatrixX3d& along);

/// Coefficients as means over models of correlated noise.
struct CorrelatedFit {
  Eigen::VectorXd estimate;         ///< p
  Eigen::MatrixXd covariance;       ///< p x p
  double degrees_of_freedom = 0.0;  ///< n - p
  double correlation = 0.0;         ///< as of CorrelatedMean
};

/// All coefficients where a response sees noise that is correlated in three axes along a direction
/// that turns: y_i = J_i p + h_i . x_i + white noise, each component of x with rho^|i - j|. The
/// models are as estimate_correlated_mean()'s, up to a correlation of 0.995; the work is linear in
/// n.
///
/// @param design    J, n x p.
/// @param response  y, n.
/// @param along     h, n x 3.
[[nodiscard]] CorrelatedFit fit_with_correlated_noise(const Eigen::MatrixXd& design,
                                                      const Eigen::VectorXd& response,
                                                      const Eigen::MatrixX3d& along);

/// As lag_one_score(), of deviations z = B e of the residuals e of a larger fit.
/// @param hat_root     K, n x q, with K K^T = B J (J^T J)^-1 J^T B^T, J the Jacobian of that fit.
/// @param hat_squares  K^T K.
[[nodiscard]] double lag_one_score_along(const Eigen::VectorXd& z,
                                         const Eigen::MatrixXd& hat_root,
                                         const Eigen::MatrixXd& hat_squares);

/// A linear fit in whose residuals each reading may share one cause, of size h_i along one
/// direction of its m residuals, that wanders from reading to reading.
struct CommonAr1Problem {
  Eigen::MatrixXd information;        ///< J^T J, q x q
  double squares = 0.0;               ///< of all residuals, which are square to J
  const Eigen::MatrixXd& along;       ///< n x q: of J, the direction that the cause has
  const Eigen::VectorXd& deviations;  ///< n: the residuals along the same direction
  Eigen::MatrixXd sizes;              ///< h, n x 1; of mean square 1
  Eigen::VectorXd places;             ///< n, as of OrderedReadings
  double degrees_of_freedom = 0.0;    ///< residuals less q
};

/// The change of the coefficients as a mean over models V = I + lambda h h^T rho^|i - j|, and the
/// covariance of the coefficients.
[[nodiscard]] CorrelatedFit fit_with_common_ar1(const CommonAr1Problem& problem);

}  // namespace axiscal
