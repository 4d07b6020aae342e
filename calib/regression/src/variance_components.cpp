// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/variance_components.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "axiscal/calib/distributions.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/piecewise_columns.hpp"

namespace axiscal {
namespace {

// The result of generalised least squares for given variances. `estimate` and `covariance` belong
// to the columns in PiecewiseColumns, not to W.
struct Solved {
  bool determined = false;
  double squares = 0.0;  // y^T V^-1 (y - W b)
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd inverses;        // the matrices V^-1 of the units, stacked; n m x m
  std::vector<Eigen::MatrixXd> U;  // the product V^-1 W for each piece
  Eigen::VectorXd left;            // the product V^-1 (y - W b), n m entries
};

// All quantities of one round of Fisher's scoring. A and g are those of fit_variance_components().
struct Round : Solved {
  Eigen::MatrixXd A;
  Eigen::VectorXd g;
  std::vector<Eigen::MatrixXd> B;  // for each component, the sum over units of U^T Q U
};

// Computes the likelihood of a problem and its derivatives for given variances.
class Likelihood {
 public:
  // @param problem  must outlive this object.
  explicit Likelihood(const VarianceProblem& problem)
      : problem_(problem), columns_(piecewise_columns(problem.W, problem.rows, problem.prior)) {
    Eigen::Index size = 0;
    for (const Eigen::MatrixXd& K : problem.roots) {
      first_root_.push_back(size);
      size += K.cols();
    }
    first_root_.push_back(size);
    roots_.resize(problem.y.size(), size);
    for (std::size_t q = 0; q < problem.roots.size(); ++q) {
      roots_.middleCols(first_root_[q], problem.roots[q].cols()) = problem.roots[q];
    }
  }

  [[nodiscard]] const PiecewiseColumns& columns() const { return columns_; }

  [[nodiscard]] Solved solve_at(const Eigen::VectorXd& theta) const {
    const Eigen::Index m = problem_.rows;
    const Eigen::Index c = columns_.count;
    Solved solved{.inverses = Eigen::MatrixXd(problem_.y.size(), m)};
    weigh_units(theta, solved);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(c, c);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(c);
    for (std::size_t p = 0; p < columns_.pieces.size(); ++p) {
      const ColumnPiece& piece = columns_.pieces[p];
      normal(piece.columns, piece.columns) += piece.W.transpose() * solved.U[p];
      right(piece.columns) +=
          solved.U[p].transpose() * problem_.y.segment(piece.first, piece.W.rows());
    }
    normal.diagonal().tail(problem_.prior).array() += 1.0;
    const PositiveFactor cholesky(normal);
    constexpr double open_below = 1e-13;
    if (!cholesky.is_determined(open_below)) {
      return solved;
    }
    solved.determined = true;
    solved.covariance = cholesky.inverse();
    solved.estimate = solved.covariance * right;
    solved.left.resize(problem_.y.size());
    for (const ColumnPiece& piece : columns_.pieces) {
      const Eigen::VectorXd estimate = solved.estimate(piece.columns);
      const Eigen::VectorXd left =
          problem_.y.segment(piece.first, piece.W.rows()) - piece.W * estimate;
      weigh_left(piece.first, left, solved);
    }
    solved.squares = problem_.y.dot(solved.left);
    return solved;
  }

  [[nodiscard]] Round round_at(const Eigen::VectorXd& theta) const {
    const auto count = static_cast<Eigen::Index>(problem_.roots.size());
    const Eigen::Index c = columns_.count;
    Round round{
        solve_at(theta), Eigen::MatrixXd::Zero(count, count), Eigen::VectorXd::Zero(count), {}};
    if (!round.determined) {
      return round;
    }
    round.B.assign(problem_.roots.size(), Eigen::MatrixXd::Zero(c, c));
    for (std::size_t p = 0; p < columns_.pieces.size(); ++p) {
      add_piece(columns_.pieces[p], round.U[p], round);
    }
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
    for (Eigen::Index q = 0; q < problem_.pure_squares.size(); ++q) {
      const double weight = theta(q) > 0.0 ? 1.0 / (theta(q) * theta(q)) : 0.0;
      round.A(q, q) += weight * problem_.pure_degrees_of_freedom(q);
      round.g(q) += weight * problem_.pure_squares(q);
    }
    return round;
  }

 private:
  // Computes V^-1 for each unit, and V^-1 W. Rows that are left out of the fit get the variance 1.
  void weigh_units(const Eigen::VectorXd& theta, Solved& solved) const {
    const Eigen::Index m = problem_.rows;
    Eigen::RowVectorXd of_roots(roots_.cols());
    for (std::size_t q = 0; q + 1 < first_root_.size(); ++q) {
      of_roots.segment(first_root_[q], first_root_[q + 1] - first_root_[q])
          .setConstant(theta(static_cast<Eigen::Index>(q)));
    }
    for (const ColumnPiece& piece : columns_.pieces) {
      Eigen::MatrixXd& U = solved.U.emplace_back(piece.W.rows(), piece.W.cols());
      for (Eigen::Index row = 0; row < U.rows(); row += m) {
        const Eigen::MatrixXd K = roots_.middleRows(piece.first + row, m);
        const Eigen::MatrixXd weighted = K.array().rowwise() * of_roots.array();
        Eigen::MatrixXd V = (weighted) * (K.transpose());
        for (Eigen::Index k = 0; k < m; ++k) {
          V(k, k) = V(k, k) > 0.0 ? V(k, k) : 1.0;
        }
        const Eigen::MatrixXd inverse = inverse_of(V);
        solved.inverses.middleRows(piece.first + row, m) = inverse;
        U.middleRows(row, m).noalias() = (inverse) * (piece.W.middleRows(row, m));
      }
    }
  }

  // Computes V^-1 times the residuals of a piece.
  // @param first  index of the piece's first row.
  // @param left   residuals y - W b of the piece.
  void weigh_left(Eigen::Index first, const Eigen::VectorXd& left, Solved& solved) const {
    const Eigen::Index m = problem_.rows;
    for (Eigen::Index row = 0; row < left.size(); row += m) {
      solved.left.segment(first + row, m) =
          (solved.inverses.middleRows(first + row, m)) * (left.segment(row, m));
    }
  }

  // Adds the contributions of a piece's units to A, g and B.
  // @param U  the product V^-1 W for this piece.
  void add_piece(const ColumnPiece& piece, const Eigen::MatrixXd& U, Round& round) const {
    const Eigen::Index m = problem_.rows;
    const std::size_t count = problem_.roots.size();
    const Eigen::MatrixXd C = round.covariance(piece.columns, piece.columns);
    const Eigen::MatrixXd UC = U * C;
    std::vector<Eigen::MatrixXd> KU;
    for (const Eigen::MatrixXd& K : problem_.roots) {
      KU.emplace_back(U.rows() / m * K.cols(), U.cols());
    }
    for (Eigen::Index row = 0; row < U.rows(); row += m) {
      const auto of_unit = U.middleRows(row, m);
      const Eigen::MatrixXd K = roots_.middleRows(piece.first + row, m);
      const Eigen::MatrixXd V = round.inverses.middleRows(piece.first + row, m);
      const Eigen::MatrixXd UCU = (UC.middleRows(row, m)) * (of_unit.transpose());
      const Eigen::MatrixXd VK = (V) * (K);
      const Eigen::MatrixXd MK = (UCU) * (K);
      const Eigen::MatrixXd KVK = (K.transpose()) * (VK);
      const Eigen::MatrixXd KMK = (K.transpose()) * (MK);
      // K contains the roots of all components. In `products`, the entries in the rows of component
      // Q and the columns of component R add up to
      // tr(V^-1 Q V^-1 R) - 2 tr(V^-1 Q U C U^T R).
      const Eigen::MatrixXd products = KVK.cwiseProduct(KVK - 2.0 * KMK);
      for (std::size_t q = 0; q < count; ++q) {
        const Eigen::Index first = first_root_[q];
        const Eigen::Index width = first_root_[q + 1] - first;
        const auto own = K.middleCols(first, width);
        KU[q].middleRows(row / m * width, width).noalias() = (own.transpose()) * (of_unit);
        for (Eigen::Index a = 0; a < width; ++a) {
          round.g(static_cast<Eigen::Index>(q)) +=
              std::pow(own.col(a).dot(round.left.segment(piece.first + row, m)), 2);
        }
        for (std::size_t r = q; r < count; ++r) {
          round.A(static_cast<Eigen::Index>(q), static_cast<Eigen::Index>(r)) +=
              products.block(first, first_root_[r], width, first_root_[r + 1] - first_root_[r])
                  .sum();
        }
      }
    }
    for (std::size_t q = 0; q < count; ++q) {
      round.B[q](piece.columns, piece.columns) += KU[q].transpose() * KU[q];
    }
  }

  const VarianceProblem& problem_;
  PiecewiseColumns columns_;
  Eigen::MatrixXd roots_;  // the roots of all components side by side, n m x r
  // index of the first column of each component in roots_; the last entry is the number of columns
  std::vector<Eigen::Index> first_root_;
};

// Solves A theta = g. If solutions are below their lower limit, the component that is furthest
// below is fixed at its limit, and the equations are solved again for the others. `open` receives
// the components that are not fixed.
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
    const Eigen::VectorXd solved = solve_symmetric(left, right);
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
    // In one step, a variance decreases by at most a factor of ten. Without this limit it could
    // become 0, and rows of variance 0 would get all the weight. Only a variance that is almost 0
    // may become 0.
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
    // Whole steps may oscillate, so half steps are used after the first rounds.
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
                    .estimate = likelihood.columns().estimate_of(round.estimate),
                    .covariance = likelihood.columns().covariance_of(round.covariance)};
    const Eigen::VectorXd units = scale(open);
    const Eigen::MatrixXd inner = units.asDiagonal() * round.A(open, open) * units.asDiagonal();
    const auto size = static_cast<Eigen::Index>(open.size());
    const Eigen::MatrixXd inverse = solve_symmetric(inner, Eigen::MatrixXd::Identity(size, size));
    const Eigen::MatrixXd in_units = 2.0 * (units.asDiagonal() * inverse * units.asDiagonal());
    fit.theta_covariance(open, open) = in_units;
    for (const Eigen::MatrixXd& B : round.B) {
      const Eigen::MatrixXd share = round.covariance * B * round.covariance;
      fit.unit_shares.push_back(likelihood.columns().covariance_of(share));
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
  const PositiveFactor information(round.A);
  constexpr double open_below = 1e-13;
  if (!information.is_determined(open_below)) {
    return std::nullopt;
  }
  const Eigen::MatrixXd inverse = information.inverse();
  return inverse.row(component).dot(round.g) / std::sqrt(2.0 * inverse(component, component));
}

std::optional<WeightedFit> fit_at_variances(const VarianceProblem& problem,
                                            const Eigen::VectorXd& theta) {
  const Likelihood likelihood(problem);
  const Solved solved = likelihood.solve_at(theta);
  if (!solved.determined) {
    return std::nullopt;
  }
  return WeightedFit{.estimate = likelihood.columns().estimate_of(solved.estimate),
                     .squares = solved.squares};
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
