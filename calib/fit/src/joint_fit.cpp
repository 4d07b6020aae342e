// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/joint_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "axiscal/calib/response_system.hpp"

namespace axiscal {
namespace {

// An axis' part in a linearised problem, in as many rows as it has columns: the residuals are
// y - P z, and the rest of them no z changes.
struct LinearisedAxis {
  LinearisedAxis(const Eigen::MatrixXd& changes, const Eigen::VectorXd& residuals, double to_spare)
      : left(to_spare) {
    Eigen::MatrixXd both(changes.rows(), changes.cols() + 1);
    both << changes, residuals;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(both);
    const Eigen::Index rows = std::min(both.rows(), both.cols());
    const Eigen::MatrixXd R = qr.matrixQR().topRows(rows).triangularView<Eigen::Upper>();
    P = R.leftCols(changes.cols());
    y = R.rightCols<1>();
  }

  Eigen::MatrixXd P;
  Eigen::VectorXd y;
  double left;  // readings less coefficients
};

// A linearised problem at given variances: -2 ln of the likelihood of what the coefficients leave
// is sum_k (N_k u_k + RSS_k e^-u_k) + ln det sum_k P_k^T P_k e^-u_k, u_k = ln sigma_k^2,
// N_k the readings less the coefficients. Its gradient is nu_k - RSS_k e^-u_k, so that it is least
// where sigma_k^2 = RSS_k / nu_k. Of variances at which the sum of the P_k^T P_k has no root it is
// not a number, and so never less than another.
struct NoiseFit {
  NoiseFit(const std::vector<LinearisedAxis>& axes, const Eigen::VectorXd& at) : log_variance(at) {
    const auto m = static_cast<Eigen::Index>(axes.size());
    const Eigen::Index columns = axes.front().P.cols();
    const Eigen::VectorXd weight = (-log_variance.array()).exp();
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd c = Eigen::VectorXd::Zero(columns);
    for (Eigen::Index k = 0; k < m; ++k) {
      const LinearisedAxis& axis = axes[static_cast<std::size_t>(k)];
      information.push_back(weight(k) * axis.P.transpose() * axis.P);
      A += information.back();
      c += weight(k) * axis.P.transpose() * axis.y;
    }
    const Eigen::LLT<Eigen::MatrixXd> cholesky(A);
    covariance = cholesky.solve(Eigen::MatrixXd::Identity(columns, columns));
    const Eigen::VectorXd z = cholesky.solve(c);
    misfit = 2.0 * cholesky.matrixLLT().diagonal().array().log().sum();
    degrees_of_freedom.resize(m);
    squares.resize(m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const LinearisedAxis& axis = axes[static_cast<std::size_t>(k)];
      const Eigen::VectorXd rest = axis.y - axis.P * z;
      gradients.push_back(weight(k) * axis.P.transpose() * rest);
      squares(k) = weight(k) * rest.squaredNorm();
      degrees_of_freedom(k) =
          axis.left - covariance.cwiseProduct(information[static_cast<std::size_t>(k)]).sum();
      misfit += axis.left * log_variance(k) + squares(k);
    }
  }

  // Towards the least misfit among variances that are not below the lowest.
  [[nodiscard]] Eigen::VectorXd newton_step(const Eigen::VectorXd& lowest) const {
    const auto m = log_variance.size();
    const Eigen::VectorXd gradient = degrees_of_freedom - squares;
    std::vector<Eigen::Index> open;
    for (Eigen::Index k = 0; k < m; ++k) {
      if (log_variance(k) > lowest(k) || gradient(k) < 0.0) {
        open.push_back(k);
      }
    }
    const auto count = static_cast<Eigen::Index>(open.size());
    Eigen::MatrixXd H(count, count);
    Eigen::VectorXd g(count);
    for (Eigen::Index a = 0; a < count; ++a) {
      const auto k = static_cast<std::size_t>(open[static_cast<std::size_t>(a)]);
      const auto own = static_cast<Eigen::Index>(k);
      const Eigen::MatrixXd CA = covariance * information[k];
      const Eigen::MatrixXd CAC = CA * covariance;
      const Eigen::VectorXd Cg = covariance * gradients[k];
      g(a) = gradient(own);
      for (Eigen::Index b = 0; b < count; ++b) {
        const auto l = static_cast<std::size_t>(open[static_cast<std::size_t>(b)]);
        H(a, b) = -CAC.cwiseProduct(information[l]).sum() - 2.0 * Cg.dot(gradients[l]);
      }
      H(a, a) += CA.trace() + squares(own);
    }
    const Eigen::LLT<Eigen::MatrixXd> cholesky(H);
    const Eigen::VectorXd newton = cholesky.solve(g);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(m);
    for (Eigen::Index a = 0; a < count; ++a) {
      const Eigen::Index k = open[static_cast<std::size_t>(a)];
      // Where the likelihood is not convex: what sigma_k^2 = RSS_k / nu_k asks for, at least by its
      // sign.
      step(k) = cholesky.info() == Eigen::Success ? -newton(a) : -g(a) / std::max(squares(k), 1.0);
    }
    constexpr double longest_step = 2.0;
    return step * std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
  }

  Eigen::VectorXd log_variance;              // u, m
  double misfit = 0.0;                       // -2 ln of the likelihood, but for a constant
  Eigen::VectorXd degrees_of_freedom;        // nu, m
  Eigen::VectorXd squares;                   // RSS_k / sigma_k^2, m
  Eigen::MatrixXd covariance;                // how well z is known
  std::vector<Eigen::MatrixXd> information;  // P_k^T P_k / sigma_k^2
  std::vector<Eigen::VectorXd> gradients;    // P_k^T (y_k - P_k z) / sigma_k^2
};

}  // namespace

JointState JointFit::at(const TableField& field) const {
  JointState state{.field = field, .tangents = {}, .axes = {}};
  const AxisDesigns designs(set_, field);
  state.tangents = field.tangents();
  const Eigen::Index directions = state.direction_count();
  FieldChanges field_changes;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    JointAxis axis;
    // Axes of the same weights share one factorisation.
    const bool shared = k > 0 && weights_.col(k) == weights_.col(k - 1) &&
                        set_.temperature.order == 0 && set_.visible.empty();
    axis.X = set_.all_columns(designs.of(k), k);
    axis.design = shared ? state.axes.back().design
                         : std::make_shared<const LeastSquaresDesign>(axis.X, weights_.col(k),
                                                                      set_.names_of_axis(k));
    axis.root_weights = weights_.col(k).cwiseSqrt();
    axis.estimate = axis.design->estimate(set_.response.col(k));
    axis.residuals = axis.root_weights.cwiseProduct(set_.response.col(k) - axis.X * axis.estimate);
    if (k == 0 || !set_.visible.empty()) {  // else what one axis sees all see
      field_changes = changes_with_directions(set_, field, state.tangents, k);
    }
    const Eigen::MatrixXd change =
        response_changes(set_, k, axis.estimate.segment<3>(1).transpose(), field_changes);
    axis.take_up.resize(axis.X.cols(), directions);
    for (Eigen::Index j = 0; j < directions; ++j) {
      axis.take_up.col(j) = axis.design->estimate(change.col(j));
    }
    axis.tangents = axis.root_weights.asDiagonal() * change;
    axis.projected = axis.root_weights.asDiagonal() * (change - axis.X * axis.take_up);
    state.axes.push_back(std::move(axis));
  }
  return state;
}

double JointFit::cost(const JointState& state, const Eigen::VectorXd& sigma) const {
  return residuals(state, sigma).squaredNorm();
}

Eigen::VectorXd JointFit::residuals(const JointState& state, const Eigen::VectorXd& sigma) const {
  Eigen::VectorXd all(set_.size() * set_.axis_count());
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    all.segment(k * set_.size(), set_.size()) =
        state.axes[static_cast<std::size_t>(k)].residuals / sigma(k);
  }
  return all;
}

Eigen::MatrixXd JointFit::stacked(const JointState& state,
                                  const Eigen::VectorXd& sigma,
                                  Eigen::MatrixXd JointAxis::*part) const {
  Eigen::MatrixXd all(set_.size() * set_.axis_count(), state.direction_count());
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    all.middleRows(k * set_.size(), set_.size()) =
        state.axes[static_cast<std::size_t>(k)].*part / sigma(k);
  }
  return all;
}

Eigen::MatrixXd JointFit::open_basis(const JointState& state, const Eigen::VectorXd& sigma) const {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(stacked(state, sigma, &JointAxis::projected),
                                              Eigen::ComputeThinV);
  const double whole = stacked(state, sigma, &JointAxis::tangents).norm();
  const Eigen::VectorXd& singular = svd.singularValues();
  // They are sorted: a direction that b and S take up comes last, and stays where it is.
  const Eigen::Index open = (singular.array() > confounded_below * whole).count();
  return svd.matrixV().leftCols(open) * singular.head(open).cwiseInverse().asDiagonal();
}

std::optional<JointState> JointFit::advanced(const JointState& state,
                                             const Eigen::VectorXd& sigma,
                                             Eigen::VectorXd& step) const {
  constexpr double longest_step_rad = 0.5;
  step *= std::min(1.0, longest_step_rad / std::max(step.norm(), 1e-300));
  const double current = cost(state, sigma);
  for (int halving = 0; halving < 12; ++halving) {
    JointState next = at(state.field.moved(state.tangents, step));
    // Near the minimum the cost's own rounding must not stop the last steps.
    if (cost(next, sigma) <= (1.0 + 1e-12) * current) {
      return next;
    }
    step *= 0.5;
  }
  return std::nullopt;
}

JointState JointFit::converged(JointState state,
                               const Eigen::VectorXd& sigma,
                               int most_rounds) const {
  for (int round = 0; round < most_rounds; ++round) {
    const Eigen::MatrixXd basis = open_basis(state, sigma);
    const Eigen::MatrixXd J = stacked(state, sigma, &JointAxis::projected) * basis;
    Eigen::VectorXd step = basis * (J.transpose() * residuals(state, sigma));
    std::optional<JointState> next = advanced(state, sigma, step);
    if (next) {
      state = std::move(*next);
    }
    if (!next || step.norm() < 1e-14) {
      break;
    }
  }
  return state;
}

Reweighting JointFit::reweighted(const JointState& state,
                                 const Eigen::VectorXd& sigma,
                                 const Eigen::VectorXd& smallest) const {
  const Eigen::MatrixXd basis = open_basis(state, sigma);
  std::vector<LinearisedAxis> axes;
  for (const JointAxis& axis : state.axes) {
    axes.emplace_back(axis.projected * basis, axis.residuals,
                      static_cast<double>(axis.design->observations() - axis.X.cols()));
  }
  const double readings =
      std::accumulate(axes.begin(), axes.end(), 0.0,
                      [](double sum, const LinearisedAxis& axis) { return sum + axis.left; });
  const Eigen::VectorXd lowest = 2.0 * smallest.array().log();
  NoiseFit best(axes, (2.0 * sigma.array().log()).max(lowest.array()).matrix());
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    Eigen::VectorXd step = best.newton_step(lowest);
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      NoiseFit next(axes, (best.log_variance + step).cwiseMax(lowest));
      // As for the directions: rounding of the likelihood must not stop the last steps.
      better = next.misfit <= best.misfit + 1e-13 * (readings + std::abs(best.misfit));
      if (better) {
        best = std::move(next);
      } else {
        step *= 0.5;
      }
    }
    if (!better || step.cwiseAbs().maxCoeff() < 1e-13) {
      break;
    }
  }
  return {.sigma = (0.5 * best.log_variance.array()).exp(),
          .degrees_of_freedom = best.degrees_of_freedom};
}

DirectionShares JointFit::shares(const JointState& state, const Eigen::VectorXd& sigma) const {
  const Eigen::MatrixXd T = stacked(state, sigma, &JointAxis::projected);
  const Eigen::MatrixXd root = open_basis(state, sigma);
  DirectionShares shares{.covariance = root * root.transpose(),
                         .degrees_of_freedom = Eigen::VectorXd(set_.axis_count())};
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const Eigen::MatrixXd part = T.middleRows(k * set_.size(), set_.size()) * root;
    shares.degrees_of_freedom(k) =
        static_cast<double>(state.axes[static_cast<std::size_t>(k)].design->observations()) -
        static_cast<double>(state.axes.front().X.cols()) - part.squaredNorm();
  }
  return shares;
}

Eigen::MatrixXd JointFit::jacobian(const JointState& state, const Eigen::VectorXd& sigma) const {
  std::vector<Eigen::MatrixXd> own;
  std::vector<Eigen::MatrixXd> shared;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    own.emplace_back(axis.root_weights.asDiagonal() * axis.X / sigma(k));
    shared.emplace_back(axis.tangents / sigma(k));
  }
  return stacked_by_axis(own, shared);
}

std::vector<std::string> JointFit::names_of_columns(const JointState& state) const {
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const std::vector<std::string> own = set_.names_of_axis(k);
    names.insert(names.end(), own.begin(), own.end());
  }
  for (std::size_t s = 0; s < state.field.size(); ++s) {
    const std::string what =
        set_.field.has_free_length(s) ? "direction and size of " : "direction of ";
    names.insert(names.end(), static_cast<std::size_t>(state.tangents[s].cols()),
                 what + set_.field.name_of(s));
  }
  return names;
}

}  // namespace axiscal
