// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Readings in the order in which they were taken, m responses of one regression each.
struct OrderedReadings {
  std::vector<Eigen::MatrixXd> designs;  ///< m of n x p; the first column is 1
  Eigen::MatrixXd responses;             ///< n x m
  Eigen::VectorXd places;   ///< n, increasing: the reading's number in the run, whole numbers
  std::vector<int> blocks;  ///< n, the readings of one block together; empty: there are none
};

/// How far the residuals of consecutive readings are more alike than those of independent ones.
///
/// The sum over the responses of sum e_i e_(i+1) / sum e^2, each response's residuals first divided
/// by their standard deviation, less its mean, over its standard deviation for white noise.
///
/// @return a number that is about normal for white noise; 0 where nothing is left over.
/// @par Source
/// Moments of a ratio of quadratic forms: Durbin & Watson, Biometrika 37 (1950) 409-428.
[[nodiscard]] double lag_one_score(const OrderedReadings& readings);

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
[[nodiscard]] CorrelatedMean mean_under_correlation(const OrderedReadings& readings);

}  // namespace axiscal
