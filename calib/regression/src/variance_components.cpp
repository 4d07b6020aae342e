// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/variance_components.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"

namespace axiscal {
namespace {

// Generalised least squares at given variances.
struct Solved {
  bool determined = false;
  double squares = 0.0;  // y^T P y
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
  std::vector<Eigen::MatrixXd> inverses;  // V^-1 of each unit
};

// All that one round needs beside it.
struct Round : Solved {
  Eigen::MatrixXd A;
  Eigen::VectorXd g;
  std::vector<Eigen::MatrixXd> B;  // sum over units of U^T Q U, U = V^-1 W
};

// The inverse of a unit's covariance; rows that are left out are on their own.
void invert_unit(const VarianceProblem& problem,
                 std::size_t unit,
                 const Eigen::VectorXd& theta,
                 Eigen::MatrixXd& inverse) {
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(problem.rows, problem.rows);
  for (std::size_t q = 0; q < problem.roots.size(); ++q) {
    const Eigen::MatrixXd& K = problem.roots[q][unit];
    V.noalias() += theta(static_cast<Eigen::Index>(q)) * K * K.transpose();
  }
  for (Eigen::Index k = 0; k < problem.rows; ++k) {
    V(k, k) = V(k, k) > 0.0 ? V(k, k) : 1.0;
  }
  inverse = V.inverse();
}

// What the units add to A and g, and the matrices B, at an estimate.
void add_units(const VarianceProblem& problem, Round& round) {
  const std::vector<Eigen::MatrixXd>& inverses = round.inverses;
  const Eigen::Index m = problem.rows;
  const std::size_t count = problem.roots.size();
  Eigen::MatrixXd U;
  Eigen::MatrixXd UC;
  Eigen::MatrixXd UCU;
  Eigen::MatrixXd KU;
  std::vector<Eigen::MatrixXd> VK(count);
  std::vector<Eigen::MatrixXd> MK(count);
  for (std::size_t i = 0; i < inverses.size(); ++i) {
    const auto first = m * static_cast<Eigen::Index>(i);
    const auto W = problem.W.middleRows(first, m);
    U.noalias() = inverses[i] * W;
    UC.noalias() = U * round.covariance;
    UCU.noalias() = UC * U.transpose();
    const Eigen::VectorXd left = inverses[i] * (problem.y.segment(first, m) - W * round.estimate);
    for (std::size_t q = 0; q < count; ++q) {
      const Eigen::MatrixXd& K = problem.roots[q][i];
      VK[q].noalias() = inverses[i] * K;
      MK[q].noalias() = UCU * K;
      KU.noalias() = K.transpose() * U;
      round.B[q].noalias() += KU.transpose() * KU;
      round.g(static_cast<Eigen::Index>(q)) += (K.transpose() * left).squaredNorm();
    }
    // tr(V^-1 Q V^-1 R) - 2 tr(V^-1 Q U C U^T R), by the roots of Q and R.
    for (std::size_t q = 0; q < count; ++q) {
      for (std::size_t r = q; r < count; ++r) {
        const Eigen::MatrixXd X = problem.roots[r][i].transpose() * VK[q];
        const Eigen::MatrixXd Y = problem.roots[r][i].transpose() * MK[q];
        round.A(static_cast<Eigen::Index>(q), static_cast<Eigen::Index>(r)) +=
            X.squaredNorm() - 2.0 * X.cwiseProduct(Y).sum();
      }
    }
  }
}

Solved solve_at(const VarianceProblem& problem, const Eigen::VectorXd& theta) {
  const Eigen::Index m = problem.rows;
  const Eigen::Index c = problem.W.cols();
  const std::size_t units = problem.roots.front().size();
  Solved solved;
  solved.inverses.resize(units);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(c, c);
  normal.diagonal().tail(problem.prior).setOnes();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(c);
  Eigen::MatrixXd U;
  for (std::size_t i = 0; i < units; ++i) {
    const auto first = m * static_cast<Eigen::Index>(i);
    invert_unit(problem, i, theta, solved.inverses[i]);
    const auto W = problem.W.middleRows(first, m);
    U.noalias() = solved.inverses[i] * W;
    normal.noalias() += W.transpose() * U;
    right.noalias() += U.transpose() * problem.y.segment(first, m);
  }
  const ScaledCholesky cholesky(normal);
  constexpr double open_below = 1e-13;
  if (!cholesky.is_determined(open_below)) {
    return solved;
  }
  solved.determined = true;
  solved.covariance = cholesky.inverse();
  solved.estimate = solved.covariance * right;
  const Eigen::VectorXd left = problem.y - problem.W * solved.estimate;
  for (std::size_t i = 0; i < units; ++i) {
    const auto first = m * static_cast<Eigen::Index>(i);
    solved.squares += problem.y.segment(first, m).dot(solved.inverses[i] * left.segment(first, m));
  }
  return solved;
}

Round evaluate(const VarianceProblem& problem, const Eigen::VectorXd& theta) {
  const Eigen::Index c = problem.W.cols();
  const auto count = static_cast<Eigen::Index>(problem.roots.size());
  Round round{solve_at(problem, theta),
              Eigen::MatrixXd::Zero(count, count),
              Eigen::VectorXd::Zero(count),
              {}};
  if (!round.determined) {
    return round;
  }
  round.B.assign(problem.roots.size(), Eigen::MatrixXd::Zero(c, c));
  add_units(problem, round);
  std::vector<Eigen::MatrixXd> CB;
  for (const Eigen::MatrixXd& B : round.B) {
    CB.emplace_back(round.covariance * B);
  }
  for (Eigen::Index q = 0; q < count; ++q) {
    for (Eigen::Index r = q; r < count; ++r) {
      round.A(q, r) += CB[static_cast<std::size_t>(q)]
                           .transpose()
                           .cwiseProduct(CB[static_cast<std::size_t>(r)])
                           .sum();
      round.A(r, q) = round.A(q, r);
    }
  }
  for (Eigen::Index q = 0; q < problem.pure_squares.size(); ++q) {
    const double weight = 1.0 / (theta(q) * theta(q));
    round.A(q, q) += weight * problem.pure_degrees_of_freedom(q);
    round.g(q) += weight * problem.pure_squares(q);
  }
  return round;
}

// A theta = g over the components that are open; what would fall below its smallest is set to that
// and the others are solved again.
Eigen::VectorXd next_theta(const Round& round,
                           const Eigen::VectorXd& scale,
                           const Eigen::VectorXd& smallest,
                           std::vector<Eigen::Index>& open) {
  const Eigen::Index count = scale.size();
  Eigen::VectorXd theta = smallest;
  open.clear();
  for (Eigen::Index q = 0; q < count; ++q) {
    open.push_back(q);
  }
  const Eigen::MatrixXd A = scale.asDiagonal() * round.A * scale.asDiagonal();
  const Eigen::VectorXd g = scale.cwiseProduct(round.g);
  while (!open.empty()) {
    Eigen::VectorXd held = theta.cwiseQuotient(scale);
    for (const Eigen::Index q : open) {
      held(q) = 0.0;
    }
    const Eigen::VectorXd right = (g - A * held)(open);
    const Eigen::MatrixXd left = A(open, open);
    const Eigen::VectorXd solved = left.ldlt().solve(right);
    auto lowest = open.end();
    double furthest = 0.0;
    for (std::size_t a = 0; a < open.size(); ++a) {
      const Eigen::Index q = open[a];
      const double below =
          (smallest(q) - scale(q) * solved(static_cast<Eigen::Index>(a))) / scale(q);
      if (!(below <= furthest)) {
        furthest = below;
        lowest = open.begin() + static_cast<std::ptrdiff_t>(a);
      }
    }
    if (lowest == open.end()) {
      for (std::size_t a = 0; a < open.size(); ++a) {
        theta(open[a]) = scale(open[a]) * solved(static_cast<Eigen::Index>(a));
      }
      return theta;
    }
    open.erase(lowest);
  }
  return theta;
}

}  // namespace

Eigen::MatrixXd VarianceFit::scatter() const {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  for (std::size_t q = 0; q < unit_shares.size(); ++q) {
    sum += theta(static_cast<Eigen::Index>(q)) * unit_shares[q];
  }
  return sum;
}

double VarianceFit::degrees_of_freedom(Eigen::Index entry) const {
  Eigen::VectorXd h(theta.size());
  for (Eigen::Index q = 0; q < theta.size(); ++q) {
    h(q) = unit_shares[static_cast<std::size_t>(q)](entry, entry);
  }
  return degrees_of_freedom_of(h);
}

double VarianceFit::degrees_of_freedom_of(const Eigen::VectorXd& h) const {
  const double variance = h.dot(theta);
  constexpr double as_good_as_infinite = 1e6;
  return std::clamp(2.0 * variance * variance / h.dot(theta_covariance * h), 1.0,
                    as_good_as_infinite);
}

double VarianceFit::component_degrees_of_freedom(Eigen::Index component) const {
  const double variance = theta_covariance(component, component);
  return variance > 0.0 ? std::max(1.0, 2.0 * theta(component) * theta(component) / variance)
                        : std::numeric_limits<double>::infinity();
}

std::optional<VarianceFit> fit_variance_components(const VarianceProblem& problem,
                                                   const Eigen::VectorXd& start) {
  constexpr int most_rounds = 200;
  constexpr double still = 1e-9;
  const Eigen::VectorXd smallest =
      problem.smallest.size() > 0 ? problem.smallest : Eigen::VectorXd::Zero(start.size());
  Eigen::VectorXd theta = start.cwiseMax(smallest);
  std::vector<Eigen::Index> open;
  for (int number = 0; number < most_rounds; ++number) {
    const Round round = evaluate(problem, theta);
    if (!round.determined) {
      return std::nullopt;
    }
    const Eigen::VectorXd scale = theta.cwiseMax(1e-8 * start);
    // Nothing falls by more than a factor of ten at once: at 0 a variance that is needed would
    // leave others without weight. What has all but gone may go.
    constexpr double gone = 1e-9;
    Eigen::VectorXd lowest = smallest;
    for (Eigen::Index q = 0; q < theta.size(); ++q) {
      if (theta(q) > gone * start(q)) {
        lowest(q) = std::max(smallest(q), 0.1 * theta(q));
      }
    }
    Eigen::VectorXd next = next_theta(round, scale, lowest, open);
    if (!next.allFinite()) {
      return std::nullopt;
    }
    // Whole steps may go to and fro; half of them do not.
    constexpr int whole_steps = 20;
    if (number >= whole_steps) {
      next = 0.5 * (theta + next);
    }
    const double change = (next - theta).cwiseQuotient(scale).cwiseAbs().maxCoeff();
    theta = next;
    if (change > still) {
      continue;
    }
    VarianceFit fit{.theta = theta,
                    .theta_covariance = Eigen::MatrixXd::Zero(theta.size(), theta.size()),
                    .information = round.A,
                    .estimate = round.estimate,
                    .covariance = round.covariance};
    const Eigen::VectorXd units = scale(open);
    const Eigen::MatrixXd inner = units.asDiagonal() * round.A(open, open) * units.asDiagonal();
    const auto size = static_cast<Eigen::Index>(open.size());
    const Eigen::MatrixXd inverse = inner.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
    const Eigen::MatrixXd in_units = 2.0 * (units.asDiagonal() * inverse * units.asDiagonal());
    fit.theta_covariance(open, open) = in_units;
    for (const Eigen::MatrixXd& B : round.B) {
      fit.unit_shares.emplace_back(round.covariance * B * round.covariance);
    }
    return fit;
  }
  return std::nullopt;
}

std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                            const Eigen::VectorXd& theta) {
  Solved solved = solve_at(problem, theta);
  if (!solved.determined) {
    return std::nullopt;
  }
  return WeightedFit{.estimate = std::move(solved.estimate), .squares = solved.squares};
}

double equal_variances_p(const Eigen::VectorXd& variances,
                         const Eigen::VectorXd& degrees_of_freedom) {
  const auto m = static_cast<double>(variances.size());
  if (m < 2.0 || !(degrees_of_freedom.minCoeff() > 1.0)) {
    return 1.0;
  }
  const double nu = degrees_of_freedom.sum();
  const double pooled = variances.dot(degrees_of_freedom) / nu;
  double statistic = nu * std::log(pooled);
  double inverse = 0.0;
  for (Eigen::Index k = 0; k < variances.size(); ++k) {
    statistic -= degrees_of_freedom(k) * std::log(variances(k));
    inverse += 1.0 / degrees_of_freedom(k);
  }
  statistic /= 1.0 + (inverse - 1.0 / nu) / (3.0 * (m - 1.0));
  return chi_squared_upper_p(std::max(statistic, 1e-12), m - 1.0);
}

}  // namespace axiscal
