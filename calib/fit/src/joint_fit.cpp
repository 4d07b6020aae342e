// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/joint_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/SVD>

#include "axiscal/calib/response_system.hpp"
#include "axiscal/calib/shared_fit.hpp"

namespace axiscal {

JointState JointFit::at(const TableField& field, bool directions_given) const {
  JointState state{.field = field, .tangents = {}, .axes = {}};
  const AxisDesigns designs(set_, field);
  if (!directions_given) {
    state.tangents = field.tangents();
  }
  const Eigen::Index directions = state.direction_count();
  FieldChanges field_changes;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    JointAxis axis;
    // Axes of the same weights share one factorisation.
    const bool shared = k > 0 && weights_.col(k) == weights_.col(k - 1) &&
                        set_.temperature.order == 0 && set_.visible.empty();
    axis.columns =
        shared ? state.axes.back().columns
               : std::make_shared<const Eigen::MatrixXd>(set_.all_columns(designs.of(k), k));
    axis.design = shared ? state.axes.back().design
                         : std::make_shared<const FactoredDesign>(
                               axis.X(), weights_.col(k), [&] { return set_.names_of_axis(k); });
    axis.root_weights = weights_.col(k).cwiseSqrt();
    axis.estimate = axis.design->estimate(set_.response.col(k));
    axis.residuals =
        axis.root_weights.cwiseProduct(set_.response.col(k) - axis.X() * axis.estimate);
    axis.take_up.resize(axis.X().cols(), directions);
    axis.tangents.resize(axis.X().rows(), directions);
    axis.projected.resize(axis.X().rows(), directions);
    if (directions > 0) {
      if (k == 0 || !set_.visible.empty()) {  // else what one axis sees all see
        field_changes = changes_with_directions(set_, field, state.tangents, k);
      }
      const Eigen::MatrixXd change =
          response_changes(set_, k, axis.estimate.segment<3>(1).transpose(), field_changes);
      axis.take_up = axis.design->estimates(change);
      axis.tangents = axis.root_weights.asDiagonal() * change;
      axis.projected = axis.root_weights.asDiagonal() * (change - axis.X() * axis.take_up);
    }
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

std::optional<Reweighting> JointFit::reweighted(const JointState& state,
                                                const Eigen::VectorXd& sigma,
                                                const Eigen::VectorXd& smallest) const {
  const Eigen::MatrixXd basis = open_basis(state, sigma);
  std::vector<ResponseSums> sums;
  for (const JointAxis& axis : state.axes) {
    const Eigen::MatrixXd P = axis.projected * basis;
    sums.push_back(
        {.information = P.transpose() * P,
         .gradient = P.transpose() * axis.residuals,
         .squares = axis.residuals.squaredNorm(),
         .degrees_of_freedom = static_cast<double>(axis.design->observations() - axis.X().cols())});
  }
  const std::optional<SharedFit> fit = fit_shared(sums, sigma.cwiseAbs2(), smallest.cwiseAbs2());
  if (!fit) {
    return std::nullopt;
  }
  return Reweighting{.sigma = fit->variance.cwiseSqrt(),
                     .degrees_of_freedom = fit->degrees_of_freedom};
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
        static_cast<double>(state.axes.front().X().cols()) - part.squaredNorm();
  }
  return shares;
}

}  // namespace axiscal
