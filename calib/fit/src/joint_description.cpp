// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "axiscal/core/not_a_number.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/fit/src/joint_solution.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// Stores the covariance of the field's direction. The covariance is larger if the weights of the
// axes were estimated (method.md, section 4).
void describe_direction(const ReadingSet& set, const JointSolution& solution, Estimate& estimate) {
  const Eigen::VectorXd& nu = solution.shares.degrees_of_freedom;
  if (!(nu.minCoeff() > 0.0)) {
    estimate.direction.se_rad = not_a_number;
    return;
  }
  const Eigen::ArrayXd information = estimate.response.sensitivity.rowwise().squaredNorm().array() /
                                     solution.sigma.array().square();
  const Eigen::ArrayXd p = information / information.sum();
  const double factor =
      solution.weights_are_estimated ? 1.0 + 4.0 * (p * (1.0 - p) / nu.array()).sum() : 1.0;
  const Eigen::MatrixXd C = factor * solution.shares.covariance;
  const Solution& state = *solution.state;
  double largest = 0.0;
  for (const Eigen::Vector3d& vector : state.field().vectors()) {
    largest = std::max(largest, vector.norm());
  }
  // The derivative of the mean field with respect to the fitted directions. The mean field is the
  // sum of the field's parts, or the mean over the blocks.
  Eigen::Matrix<double, 3, Eigen::Dynamic> T(3, state.direction_count());
  for (std::size_t s = 0; s < state.field().size(); ++s) {
    const Eigen::Index first = state.first_direction(s);
    T.middleCols(first, state.tangents[s].cols()) =
        state.field().change_of_mean(s) * (state.field().step_unit(s) * state.tangents[s]);
    const Eigen::Index own = state.tangents[s].cols();
    const Eigen::MatrixXd spread = C.block(first, first, own, own);
    // The uncertainty of a part's direction counts in proportion to the size of the part. A small
    // part is, for example, the Earth's rotation on a turntable.
    const double weight = set.field.is_sum() ? state.field().step_unit(s) / largest : 1.0;
    estimate.direction.se_rad = std::max(
        estimate.direction.se_rad, weight * std::sqrt(symmetric_eigen(spread).values.maxCoeff()));
  }
  estimate.direction.covariance = T * C * T.transpose();
  estimate.direction.degrees_of_freedom =
      solution.weights_are_estimated ? 1.0 / (p.square() / nu.array()).sum() : nu.sum();
}

}  // namespace

Estimate describe_joint(const ReadingSet& set,
                        const JointSolution& solution,
                        const Eigen::MatrixXd& robust_weights) {
  const Eigen::Index m = set.axis_count();
  const Solution& state = *solution.state;
  const Eigen::MatrixXd& C = solution.shares.covariance;
  Estimate estimate;
  RegressionRows rows = rows_of_readings(set);
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  statistics.degrees_of_freedom = solution.shares.degrees_of_freedom;
  statistics.residual_sd = Eigen::VectorXd::Constant(m, not_a_number);
  estimate.field = state.field();
  const Eigen::Index p = set.coefficient_count();
  std::optional<LeastSquaresDesign> design;
  Eigen::MatrixXd take_up(p * m, C.rows());  // take_up of all axes, one below the other
  for (Eigen::Index k = 0; k < m; ++k) {
    take_up.middleRows(p * k, p) = state.axes[static_cast<std::size_t>(k)].take_up.topRows(p);
  }
  const Eigen::MatrixXd covariance_of_take_up = take_up * C;
  statistics.covariance = covariance_of_take_up * take_up.transpose();
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = state.axes[static_cast<std::size_t>(k)];
    if (k == 0 || axis.design != state.axes[static_cast<std::size_t>(k) - 1].design) {
      design.emplace(*axis.design, axis.X());
    }
    const double nu = statistics.degrees_of_freedom(k);
    const double s = solution.sigma(k);
    if (nu > 0.0) {
      statistics.residual_sd(k) = set.robust ? s : std::sqrt(axis.residuals.squaredNorm() / nu);
    }
    set_coefficients(set, k, axis.estimate, estimate);
    statistics.r_squared(k) =
        r_squared_about_mean(set.response.col(k), set.weights.col(k), axis.residuals);

    const double s2 = statistics.residual_sd(k) * statistics.residual_sd(k);
    const Eigen::MatrixXd C_of_axis = C / (s * s);
    const Eigen::MatrixXd own =
        design->unscaled_covariance() + axis.take_up * C_of_axis * axis.take_up.transpose();
    statistics.covariance.block(p * k, p * k, p, p) +=
        s2 * design->unscaled_covariance().topLeftCorner(p, p);
    statistics.variance_inflation.row(k) =
        variance_inflation(axis.X(), set.weights.col(k), own).segment<3>(1);

    const Eigen::VectorXd leverage =
        design->leverage() +
        (axis.projected * C_of_axis).cwiseProduct(axis.projected).rowwise().sum();
    const double parameters = static_cast<double>(axis.design->observations()) - nu;
    put_diagnostics(statistics, k, leverage,
                    set.robust ? scale_residuals(axis.residuals, leverage, s, parameters)
                               : diagnose_residuals(axis.residuals, leverage, nu, parameters),
                    set.robust ? robust_weights.col(k) : Eigen::VectorXd());
    statistics.lack_of_fit.push_back(test_lack_of_fit(
        rows, set.weights.col(k), axis.residuals, nu, set.rounding(k), set.effects.columns.cols(),
        set.robust ? Eigen::VectorXd(robust_weights.col(k)) : Eigen::VectorXd()));
  }
  describe_direction(set, solution, estimate);
  return estimate;
}

}  // namespace axiscal
