// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <optional>
#include <utility>

#include <Eigen/Core>

namespace axiscal {

/// A least-squares problem linearised at one place: the residuals there, and their derivative with
/// respect to the p unknowns.
struct Linearised {
  Eigen::VectorXd residuals;  ///< n, in units of their noise
  Eigen::MatrixXd jacobian;   ///< n x p
  /// Singular values of the Jacobian that are not above this count as 0: no step is taken there.
  double open_below = 0.0;
};

/// The step s that makes |r + J s|^2 + damping |L s|^2 smallest, L the lengths of J's columns.
///
/// @param by_qr  whether it is to have all digits: by QR, and of smallest norm where J leaves
///               something open, unless J's columns are far from dependent. Else J^T J will do as
///               long as it is not too close to singular.
[[nodiscard]] Eigen::VectorXd damped_step(const Linearised& linear, double damping, bool by_qr);

/// As above, by the normal equations, with columns scaled to length 1. It is fast, and accurate
/// enough for steps far from the solution.
///
/// @return nullopt if a pivot is below the smallest one, that is, if the normal equations are close
///         to singular.
[[nodiscard]] std::optional<Eigen::VectorXd> step_by_normal_equations(const Linearised& linear,
                                                                      double damping,
                                                                      double smallest_pivot);

/// The interface of a problem for gauss_newton(). `State` is the point of the search, on a manifold
/// or not; `Linear` is a Linearised, and may hold more.
template <typename Problem>
concept GaussNewtonProblem = requires(const Problem problem,
                                      const typename Problem::State at,
                                      typename Problem::Linear linear,
                                      const Eigen::VectorXd step) {
  // Residuals and Jacobian at a place. A prior is one row for each of its standard deviations.
  {problem.linearise(at, linear)};
  // The retraction: the place that a step leads to.
  { problem.moved(at, step) } -> std::convertible_to<typename Problem::State>;
  // Sum of squares at a place, with the weights of `linear`; NaN or infinite at places that cannot
  // be solutions.
  { problem.cost(at, linear) } -> std::convertible_to<double>;
  // Length of a step from there, in the problem's measure; 1 is far.
  { problem.length(at, step, linear) } -> std::convertible_to<double>;
};

struct GaussNewtonOptions {
  int most_rounds = 200;
  int most_attempts = 30;       ///< of one step, each damped ten times more than the one before
  double settled = 1e-13;       ///< a step of this length is the last
  double first_damping = 0.0;   ///< of a start from which an undamped step could go anywhere
  double qr_from_below = 1e-6;  ///< steps after one that is shorter than this are by QR
  double slack = 1e-12;         ///< part of the cost by which a good step may make it larger
};

template <typename State>
struct GaussNewtonResult {
  State state;
  int rounds = 0;
  double left_to_go = 1.0;  ///< about the length of the next step, or of one that helped nothing
  bool converged = false;   ///< no further step is worth taking, or none makes it better
};

/// Gauss-Newton, damped (Levenberg-Marquardt, columns of length 1) once a step makes the fit worse.
/// Far from the solution the step comes from J^T J. The last steps, which determine the result, use
/// QR if J^T J is inaccurate; the error of J^T J is only a part of a step.
///
/// @par Source
/// Nocedal & Wright, Numerical Optimization, 2nd ed. (2006), sec. 10.3; Marquardt, J. SIAM 11
/// (1963) 431-441.
template <GaussNewtonProblem Problem>
[[nodiscard]] GaussNewtonResult<typename Problem::State> gauss_newton(
    const Problem& problem, typename Problem::State start, const GaussNewtonOptions& options = {}) {
  // In units of a residual's variance: a shorter step is tried only if it promises this decrease.
  // Such a step moves the solution by 1e-4 of its uncertainty.
  constexpr double worth_another_try = 1e-8;
  constexpr double no_damping_below = 1e-9;
  constexpr double least_damping = 1e-6;
  GaussNewtonResult<typename Problem::State> result{.state = std::move(start)};
  typename Problem::Linear linear;
  double last_length = 1.0;  // of the last step that was taken
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
    for (int attempt = 0; attempt < options.most_attempts && !better; ++attempt) {
      const Eigen::VectorXd step = damped_step(linear, damping, by_qr);
      if (!step.allFinite()) {
        break;
      }
      typename Problem::State next = problem.moved(result.state, step);
      better = problem.cost(next, linear) <= (1.0 + options.slack) * cost;
      const double length = problem.length(result.state, step, linear);
      if (attempt == 0) {
        result.left_to_go = length;
      }
      if (better) {
        last_length = length;
        result.state = std::move(next);
        damping = damping > no_damping_below ? damping / 10.0 : 0.0;
        continue;
      }
      const Eigen::VectorXd change = linear.jacobian * step;
      const double promised = -change.dot(2.0 * linear.residuals + change);
      if (promised < worth_another_try * cost / freedom) {
        break;
      }
      damping = std::max(10.0 * damping, least_damping);
    }
    if (!better) {
      result.converged = std::isfinite(cost);
      break;
    }
    // The next step would be shorter by as much again.
    result.left_to_go = last_length * std::min(1.0, last_length / length_before);
    result.converged =
        last_length < options.settled || (by_qr && result.left_to_go < options.settled);
  }
  return result;
}

}  // namespace axiscal
