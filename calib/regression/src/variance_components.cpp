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
  Eigen::MatrixXd inverses;  // n m x m: V^-1 of each unit
  Eigen::MatrixXd U;         // n m x c: V^-1 W
  Eigen::VectorXd left;      // n m: V^-1 (y - W b)
};

// All that one round needs beside it.
struct Round : Solved {
  Eigen::MatrixXd A;
  Eigen::VectorXd g;
  std::vector<Eigen::MatrixXd> B;  // sum over units of U^T Q U
};

// A unit's matrices of at most so many rows and columns: few need no memory of their own.
template <int Most>
using UnitMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, Most>;
constexpr int few = 6;

// Few rows are multiplied where they are; what makes many fast costs few most of the time.
template <int Most, typename Left, typename Right, typename Result>
void set_product(const Left& left, const Right& right, Result& result) {
  if constexpr (Most == Eigen::Dynamic) {
    result.noalias() = left * right;
  } else {
    result.noalias() = left.lazyProduct(right);
  }
}

// Up to three rows in closed form.
template <int Most>
UnitMatrix<Most> inverse_of(const UnitMatrix<Most>& V) {
  switch (V.rows()) {
    case 1:
      return V.cwiseInverse();
    case 2:
      return Eigen::Matrix2d(V).inverse();
    case 3:
      return Eigen::Matrix3d(V).inverse();
    default:
      return V.inverse();
  }
}

// A problem's likelihood at any variances.
class Likelihood {
 public:
  // @param problem  must outlive it.
  explicit Likelihood(const VarianceProblem& problem)
      : problem_(problem),
        small_(problem.rows <= few && std::all_of(problem.roots.begin(),
                                                  problem.roots.end(),
                                                  [](const auto& K) { return K.cols() <= few; })) {
    for (const Eigen::MatrixXd& K : problem.roots) {
      Eigen::MatrixXd& Q = Q_.emplace_back(K.rows(), problem.rows);
      for (Eigen::Index first = 0; first < K.rows(); first += problem.rows) {
        const auto of_unit = K.middleRows(first, problem.rows);
        Q.middleRows(first, problem.rows).noalias() = of_unit * of_unit.transpose();
      }
    }
  }

  [[nodiscard]] Solved solve_at(const Eigen::VectorXd& theta) const {
    const Eigen::Index m = problem_.rows;
    Solved solved{.inverses = Eigen::MatrixXd(problem_.y.size(), m),
                  .U = Eigen::MatrixXd(problem_.y.size(), problem_.W.cols())};
    if (small_) {
      weigh_units<few>(theta, solved);
    } else {
      weigh_units<Eigen::Dynamic>(theta, solved);
    }
    Eigen::MatrixXd normal = problem_.W.transpose() * solved.U;
    normal.diagonal().tail(problem_.prior).array() += 1.0;
    const ScaledCholesky cholesky(normal);
    constexpr double open_below = 1e-13;
    if (!cholesky.is_determined(open_below)) {
      return solved;
    }
    solved.determined = true;
    solved.covariance = cholesky.inverse();
    solved.estimate = solved.covariance * (solved.U.transpose() * problem_.y);
    const Eigen::VectorXd left = problem_.y - problem_.W * solved.estimate;
    solved.left.resize(left.size());
    for (Eigen::Index first = 0; first < left.size(); first += m) {
      solved.left.segment(first, m).noalias() =
          solved.inverses.middleRows(first, m) * left.segment(first, m);
    }
    solved.squares = problem_.y.dot(solved.left);
    return solved;
  }

  [[nodiscard]] Round round_at(const Eigen::VectorXd& theta) const {
    const auto count = static_cast<Eigen::Index>(problem_.roots.size());
    Round round{
        solve_at(theta), Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count), {}};
    if (!round.determined) {
      return round;
    }
    const Eigen::Index units = problem_.y.size() / problem_.rows;
    std::vector<Eigen::MatrixXd> KU;
    for (const Eigen::MatrixXd& K : problem_.roots) {
      KU.emplace_back(units * K.cols(), problem_.W.cols());
    }
    if (small_) {
      add_units<few>(round, KU);
    } else {
      add_units<Eigen::Dynamic>(round, KU);
    }
    std::vector<Eigen::MatrixXd> CB;
    for (const Eigen::MatrixXd& rows : KU) {
      const Eigen::MatrixXd& B = round.B.emplace_back(rows.transpose() * rows);
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
    for (Eigen::Index q = 0; q < problem_.pure_squares.size(); ++q) {
      const double weight = theta(q) > 0.0 ? 1.0 / (theta(q) * theta(q)) : 0.0;
      round.A(q, q) += weight * problem_.pure_degrees_of_freedom(q);
      round.g(q) += weight * problem_.pure_squares(q);
    }
    return round;
  }

 private:
  // The inverse of each unit's covariance, and what it makes of W; rows that are left out are on
  // their own.
  template <int Most>
  void weigh_units(const Eigen::VectorXd& theta, Solved& solved) const {
    const Eigen::Index m = problem_.rows;
    for (Eigen::Index first = 0; first < problem_.y.size(); first += m) {
      UnitMatrix<Most> V = UnitMatrix<Most>::Zero(m, m);
      for (std::size_t q = 0; q < Q_.size(); ++q) {
        V += theta(static_cast<Eigen::Index>(q)) * Q_[q].middleRows(first, m);
      }
      for (Eigen::Index k = 0; k < m; ++k) {
        V(k, k) = V(k, k) > 0.0 ? V(k, k) : 1.0;
      }
      const UnitMatrix<Most> inverse = inverse_of<Most>(V);
      solved.inverses.middleRows(first, m) = inverse;
      auto U = solved.U.middleRows(first, m);
      set_product<Most>(inverse, problem_.W.middleRows(first, m), U);
    }
  }

  // What the units add to A and g, and the rows K^T U of all of them.
  template <int Most>
  void add_units(Round& round, std::vector<Eigen::MatrixXd>& KU) const {
    const Eigen::Index m = problem_.rows;
    const std::size_t count = Q_.size();
    const Eigen::MatrixXd UC = round.U * round.covariance;
    UnitMatrix<Most> UCU(m, m);
    std::vector<UnitMatrix<Most>> VQ(count, UCU);
    std::vector<UnitMatrix<Most>> MQ(count, UCU);
    for (Eigen::Index first = 0; first < problem_.y.size(); first += m) {
      const auto U = round.U.middleRows(first, m);
      const auto left = round.left.segment(first, m);
      set_product<Most>(UC.middleRows(first, m), U.transpose(), UCU);
      for (std::size_t q = 0; q < count; ++q) {
        const auto Q = Q_[q].middleRows(first, m);
        const auto K = problem_.roots[q].middleRows(first, m);
        set_product<Most>(round.inverses.middleRows(first, m), Q, VQ[q]);
        set_product<Most>(UCU, Q, MQ[q]);
        auto own = KU[q].middleRows(first / m * K.cols(), K.cols());
        set_product<Most>(K.transpose(), U, own);
        round.g(static_cast<Eigen::Index>(q)) += left.dot(Q * left);
      }
      // tr(V^-1 Q V^-1 R) - 2 tr(V^-1 Q U C U^T R).
      for (std::size_t q = 0; q < count; ++q) {
        for (std::size_t r = q; r < count; ++r) {
          round.A(static_cast<Eigen::Index>(q), static_cast<Eigen::Index>(r)) +=
              VQ[q].cwiseProduct((VQ[r] - 2.0 * MQ[r]).transpose()).sum();
        }
      }
    }
  }

  const VarianceProblem& problem_;
  bool small_;
  std::vector<Eigen::MatrixXd> Q_;  // q, n m x m: K K^T of each unit
};

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
                                                   const Eigen::VectorXd& start,
                                                   double still) {
  constexpr int most_rounds = 200;
  const Eigen::VectorXd smallest =
      problem.smallest.size() > 0 ? problem.smallest : Eigen::VectorXd::Zero(start.size());
  const Likelihood likelihood(problem);
  Eigen::VectorXd theta = start.cwiseMax(smallest);
  std::vector<Eigen::Index> open;
  for (int number = 0; number < most_rounds; ++number) {
    const Round round = likelihood.round_at(theta);
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

std::optional<double> component_score(const VarianceProblem& problem,
                                      const Eigen::VectorXd& theta,
                                      Eigen::Index component) {
  const Round round = Likelihood(problem).round_at(theta);
  if (!round.determined) {
    return std::nullopt;
  }
  const ScaledCholesky information(round.A);
  constexpr double open_below = 1e-13;
  if (!information.is_determined(open_below)) {
    return std::nullopt;
  }
  const Eigen::MatrixXd inverse = information.inverse();
  return inverse.row(component).dot(round.g) / std::sqrt(2.0 * inverse(component, component));
}

std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                            const Eigen::VectorXd& theta) {
  Solved solved = Likelihood(problem).solve_at(theta);
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
