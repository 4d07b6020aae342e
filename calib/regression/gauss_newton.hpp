// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <optional>
#include <utility>

#include <Eigen/Core>

namespace axiscal {

/// A least-squares problem, linearised at one point: the residuals at this point, and their
/// derivative with respect to the p unknowns.
struct Linearised {
  Eigen::VectorXd residuals;  ///< n residuals, each divided by the sd of its noise
  Eigen::MatrixXd jacobian;   ///< n x p
  /// Singular values of the Jacobian up to this limit count as 0. Steps have no component along
  /// the singular vectors of these values.
  double open_below = 0.0;
};

/// Returns the step s that minimises |r + J s|^2 + damping |L s|^2. L is the diagonal matrix with
/// the lengths of J's columns.
///
/// @param by_qr  if true, the step is accurate: it is computed by QR unless J is well conditioned.
///               If J does not determine all unknowns, it is the step of smallest norm. If false,
///               the step is fast: it is computed from J^T J unless J^T J is nearly singular.
[[nodiscard]] Eigen::VectorXd damped_step(const Linearised& linear, double damping, bool by_qr);

/// Like damped_step(), but computed from the normal equations, with columns scaled to length 1.
/// This is fast, and accurate enough for steps far from the solution.
///
/// @return nullopt if a pivot is below `smallest_pivot`, which means that the normal equations are
///         close to singular.
[[nodiscard]] std::optional<Eigen::VectorXd> step_by_normal_equations(const Linearised& linear,
                                                                      double damping,
                                                                      double smallest_pivot);

/// The requirements on a problem for gauss_newton(). `State` is the type of a point of the search;
/// it need not be a vector. `Linear` is derived from Linearised.
template <typename Problem>
concept GaussNewtonProblem = requires(const Problem problem,
                                      const typename Problem::State at,
                                      typename Problem::Linear linear,
                                      const Eigen::VectorXd step) {
  // Computes residuals and Jacobian at a point. Prior information on an unknown adds one row.
  {problem.linearise(at, linear)};
  // Returns the point after a step.
  { problem.moved(at, step) } -> std::convertible_to<typename Problem::State>;
  // Returns the sum of squares at a point, with the weights of `linear`; NaN or infinity at points
  // that cannot be solutions.
  { problem.cost(at, linear) } -> std::convertible_to<double>;
  // Returns the length of a step from a point. The problem defines this length; a length of 1 is a
  // large step.
  { problem.length(at, step, linear) } -> std::convertible_to<double>;
};

struct GaussNewtonOptions {
  int most_rounds = 200;
  /// largest number of attempts for one step; each attempt has ten times more damping
  int most_attempts = 30;
  double settled = 1e-13;  ///< the search ends after a step shorter than this
  /// damping of the first step; above 0 if the start is near a singular point
  double first_damping = 0.0;
  double qr_from_below = 1e-6;  ///< steps are computed by QR after a step shorter than this
  double slack = 1e-12;         ///< fraction by which an accepted step may increase the cost
  double least_decrease = 0.0;  ///< the search also ends after a step that decreases the cost by
                                ///< less than this fraction
};

template <typename State>
struct GaussNewtonResult {
  State state;
  int rounds = 0;
  /// estimated length of the next step; after a rejected step, the length of the rejected step
  double left_to_go = 1.0;
  /// true if the next step is negligible, or if no step decreases the cost
  bool converged = false;
};

/// Minimises the sum of squares by the Gauss-Newton method. If a step increases the sum, it is
/// repeated with damping (Levenberg-Marquardt, for columns scaled to length 1). Far from the
/// solution, steps are computed from J^T J. The last steps determine the accuracy of the result;
/// they use QR if J^T J is inaccurate.
///
/// @par Source
/// Nocedal & Wright, Numerical Optimization, 2nd ed. (2006), sec. 10.3; Marquardt, J. SIAM 11
/// (1963) 431-441.
template <GaussNewtonProblem Problem>
[[nodiscard]] GaussNewtonResult<typename Problem::State> gauss_newton(
    const Problem& problem, typename Problem::State start, const GaussNewtonOptions& options = {}) {
  // After a rejected step, a shorter step is tried only if (predicted decrease of the cost) /
  // (variance of a residual) is above this limit. A step with this decrease moves the solution by
  // 1e-4 of its uncertainty.
  constexpr double worth_another_try = 1e-8;
  constexpr double no_damping_below = 1e-9;
  constexpr double least_damping = 1e-6;
  // A step without damping is not taken if it is shorter than `negligible`, and if its predicted
  // decrease divided by the variance of a residual is below `least_worth_a_step`. It would move the
  // solution by less than 6e-10 of its uncertainty.
  constexpr double negligible = 1e-13;
  constexpr double least_worth_a_step = 4e-19;
  GaussNewtonResult<typename Problem::State> result{.state = std::move(start)};
  typename Problem::Linear linear;
  double last_length = 1.0;  // length of the last step that was accepted
  double damping = options.first_damping;
  while (!result.converged && result.rounds < options.most_rounds) {
    ++result.rounds;
    problem.linearise(result.state, linear);
    const double cost = linear.residuals.squaredNorm();
    const auto freedom = static_cast<double>(
        std::max<Eigen::Index>(linear.jacobian.rows() - linear.jacobian.cols(), 1));
    const bool by_qr = last_length < options.qr_from_below;
    const double length_before = last_length;
    bool better = false;
    bool decrease_is_small = false;
    for (int attempt = 0; attempt < options.most_attempts && !better; ++attempt) {
      Eigen::VectorXd step = damped_step(linear, damping, by_qr);
      if (!step.allFinite()) {
        break;
      }
      double length = problem.length(result.state, step, linear);
      if (damping == 0.0 && length < negligible && !by_qr) {
        step = damped_step(linear, damping, true);
        length = problem.length(result.state, step, linear);
      }
      if (attempt == 0) {
        result.left_to_go = length;
      }
      const Eigen::VectorXd change = linear.jacobian * step;
      const double promised = -change.dot(2.0 * linear.residuals + change);
      if (damping == 0.0 && length < negligible &&
          promised <= least_worth_a_step * cost / freedom) {
        result.converged = true;
        return result;
      }
      typename Problem::State next = problem.moved(result.state, step);
      const double next_cost = problem.cost(next, linear);
      better = next_cost <= (1.0 + options.slack) * cost;
      if (better) {
        last_length = length;
        result.state = std::move(next);
        damping = damping > no_damping_below ? damping / 10.0 : 0.0;
        decrease_is_small = cost - next_cost < options.least_decrease * cost;
        continue;
      }
      if (promised < worth_another_try * cost / freedom) {
        break;
      }
      damping = std::max(10.0 * damping, least_damping);
    }
    if (!better) {
      result.converged = std::isfinite(cost);
      break;
    }
    // The ratio of the next step's length to the last one's is assumed to equal the ratio of the
    // last two lengths.
    result.left_to_go = last_length * std::min(1.0, last_length / length_before);
    result.converged = decrease_is_small || last_length < options.settled ||
                       (by_qr && result.left_to_go < options.settled);
  }
  return result;
}

}  // namespace axiscal
