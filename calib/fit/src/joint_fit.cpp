// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/joint_fit.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <Eigen/SVD>

#include "axiscal/calib/response_system.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"

namespace axiscal {

void JointAxis::find_sums() {
  sums = {.information = projected.transpose() * projected,
          .gradient = projected.transpose() * residuals,
          .squares = residuals.squaredNorm(),
          .degrees_of_freedom = static_cast<double>(design->observations() - X().cols())};
  tangent_squares = tangents.colwise().squaredNorm().transpose();
}

std::shared_ptr<const JointState> JointFit::at(const TableField& field,
                                               bool directions_given) const {
  const auto result =
      std::make_shared<JointState>(JointState{.field = field, .tangents = {}, .axes = {}});
  JointState& state = *result;
  const AxisDesigns designs(set_, field);
  if (!directions_given) {
    state.tangents = field.tangents();
  }
  const Eigen::Index m = set_.axis_count();
  state.axes.reserve(static_cast<std::size_t>(m));
  FieldChanges field_changes;
  for (Eigen::Index first = 0; first < m;) {
    const Eigen::Index end = set_.end_of_alike(first, weights_);  // which share one factorisation
    if (state.direction_count() > 0 && (first == 0 || !set_.visible.empty())) {
      // What one axis sees all see, but for those.
      field_changes = changes_with_directions(set_, field, state.tangents, first);
    }
    add_axes(first, end - first,
             std::make_shared<const Eigen::MatrixXd>(set_.all_columns(designs.of(first), first)),
             field_changes, state);
    first = end;
  }
  return result;
}

void JointFit::add_axes(Eigen::Index first,
                        Eigen::Index count,
                        const std::shared_ptr<const Eigen::MatrixXd>& columns,
                        FieldChanges& field_changes,
                        JointState& state) const {
  const Eigen::MatrixXd& X = *columns;
  const auto design = std::make_shared<const FactoredDesign>(
      X, weights_.col(first), [&] { return set_.names_of_axis(first); });
  const Eigen::VectorXd& root_weights = design->root_weights();
  const Eigen::Index directions = state.direction_count();
  const Eigen::MatrixXd estimates = design->estimates(set_.response.middleCols(first, count));
  const Eigen::MatrixXd residuals =
      root_weights.asDiagonal() * (set_.response.middleCols(first, count) - X * estimates);
  Eigen::MatrixXd changes(set_.size(), directions * count);  // of all axes, side by side
  for (Eigen::Index a = 0; a < count && directions > 0; ++a) {
    changes.middleCols(directions * a, directions) = response_changes(
        set_, first + a, estimates.col(a).segment<3>(1).transpose(), field_changes);
  }
  if (first + count == set_.axis_count()) {
    field_changes.resize(0, 0);  // of long runs they are large
  }
  // Weighted from here on.
  changes.array().colwise() *= root_weights.array();
  const Eigen::MatrixXd in_basis = design->basis().transpose() * changes;
  const Eigen::MatrixXd take_up = design->root_of_covariance() * in_basis;
  const Eigen::MatrixXd projected = changes - design->basis() * in_basis;
  for (Eigen::Index a = 0; a < count; ++a) {
    JointAxis& axis = state.axes.emplace_back();
    axis.columns = columns;
    axis.design = design;
    axis.estimate = estimates.col(a);
    axis.residuals = residuals.col(a);
    axis.tangents = changes.middleCols(directions * a, directions);
    axis.take_up = take_up.middleCols(directions * a, directions);
    axis.projected = projected.middleCols(directions * a, directions);
    axis.find_sums();
  }
}

double JointFit::cost(const JointState& state, const Eigen::VectorXd& sigma) const {
  double sum = 0.0;
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    sum += state.axes[static_cast<std::size_t>(k)].sums.squares / (sigma(k) * sigma(k));
  }
  return sum;
}

Eigen::MatrixXd JointFit::open_basis(const JointState& state, const Eigen::VectorXd& sigma) const {
  const Eigen::Index D = state.direction_count();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(D, D);
  double whole = 0.0;  // square of what the directions change at all
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    information += axis.sums.information / (sigma(k) * sigma(k));
    whole += axis.tangent_squares.sum() / (sigma(k) * sigma(k));
  }
  constexpr double clearly_open = 1e-6;  // of squares, where normal equations do
  const ScaledCholesky cholesky(information);
  if (cholesky.is_determined(clearly_open) &&
      (information.diagonal().array() > clearly_open * whole).all()) {
    return cholesky.root_of_inverse();
  }
  Eigen::MatrixXd projected(set_.size() * set_.axis_count(), D);  // axis below axis
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    projected.middleRows(k * set_.size(), set_.size()) =
        state.axes[static_cast<std::size_t>(k)].projected / sigma(k);
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(projected, Eigen::ComputeThinV);
  const Eigen::VectorXd& singular = svd.singularValues();
  // They are sorted: a direction that b and S take up comes last, and stays where it is.
  const Eigen::Index open = (singular.array() > confounded_below * std::sqrt(whole)).count();
  return svd.matrixV().leftCols(open) * singular.head(open).cwiseInverse().asDiagonal();
}

std::shared_ptr<const JointState> JointFit::advanced(const JointState& state,
                                                     const Eigen::VectorXd& sigma,
                                                     Eigen::VectorXd step) const {
  constexpr double longest_step_rad = 0.5;
  step *= std::min(1.0, longest_step_rad / std::max(step.norm(), 1e-300));
  const double current = cost(state, sigma);
  for (int halving = 0; halving < 12; ++halving) {
    // The first is mostly the last; of shorter ones nothing but the cost is asked until one is
    // good.
    const TableField moved = state.field.moved(state.tangents, step);
    const bool cost_alone = halving > 0;
    std::shared_ptr<const JointState> next = at(moved, cost_alone);
    // Near the minimum the cost's own rounding must not stop the last steps.
    if (cost(*next, sigma) <= (1.0 + 1e-12) * current) {
      return cost_alone ? at(moved) : next;
    }
    step *= 0.5;
  }
  return nullptr;
}

std::shared_ptr<const JointState> JointFit::converged(std::shared_ptr<const JointState> state,
                                                      const Eigen::VectorXd& sigma,
                                                      int most_rounds) const {
  for (int round = 0; round < most_rounds; ++round) {
    const Eigen::MatrixXd basis = open_basis(*state, sigma);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(basis.rows());
    for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
      gradient += state->axes[static_cast<std::size_t>(k)].sums.gradient / (sigma(k) * sigma(k));
    }
    const Eigen::VectorXd step = basis * (basis.transpose() * gradient);
    constexpr double still_rad = 1e-14;
    if (step.norm() < still_rad) {
      break;
    }
    std::shared_ptr<const JointState> next = advanced(*state, sigma, step);
    if (!next) {
      break;
    }
    state = std::move(next);
  }
  return state;
}

std::optional<Reweighting> JointFit::reweighted(const JointState& state,
                                                const Eigen::VectorXd& sigma,
                                                const Eigen::VectorXd& smallest) const {
  const Eigen::MatrixXd basis = open_basis(state, sigma);
  std::vector<ResponseSums> sums;
  for (const JointAxis& axis : state.axes) {
    sums.push_back({.information = basis.transpose() * axis.sums.information * basis,
                    .gradient = basis.transpose() * axis.sums.gradient,
                    .squares = axis.sums.squares,
                    .degrees_of_freedom = axis.sums.degrees_of_freedom});
  }
  const std::optional<SharedFit> fit = fit_shared(sums, sigma.cwiseAbs2(), smallest.cwiseAbs2());
  if (!fit) {
    return std::nullopt;
  }
  return Reweighting{.sigma = fit->variance.cwiseSqrt(),
                     .degrees_of_freedom = fit->degrees_of_freedom};
}

DirectionShares JointFit::shares(const JointState& state, const Eigen::VectorXd& sigma) const {
  const Eigen::MatrixXd root = open_basis(state, sigma);
  DirectionShares shares{.covariance = root * root.transpose(),
                         .degrees_of_freedom = Eigen::VectorXd(set_.axis_count())};
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const ResponseSums& own = state.axes[static_cast<std::size_t>(k)].sums;
    const double left =
        own.degrees_of_freedom -
        own.information.cwiseProduct(shares.covariance).sum() / (sigma(k) * sigma(k));
    // Whole where it is but for rounding, of which tests would make a degree of freedom.
    const double whole = std::round(left);
    shares.degrees_of_freedom(k) = std::abs(left - whole) < 1e-9 ? whole : left;
  }
  return shares;
}

}  // namespace axiscal
