// SPDX-License-Identifier: Apache-2.0
#include "joint_fit.hpp"

#include <algorithm>

#include <Eigen/SVD>

#include "axiscal/core/rotation.hpp"

namespace axiscal {

JointState JointFit::at(const std::vector<Eigen::Vector3d>& fields) const {
  JointState state{.fields = fields, .tangents = {}, .X = field_design(set_, fields), .axes = {}};
  const Eigen::Index directions = state.direction_count();
  std::vector<Eigen::Vector3d> along_first;
  std::vector<Eigen::Vector3d> along_second;
  for (const Eigen::Vector3d& field : fields) {
    state.tangents.emplace_back(tangents_of(field));
    along_first.emplace_back(field.norm() * state.tangents.back().col(0));
    along_second.emplace_back(field.norm() * state.tangents.back().col(1));
  }
  const Eigen::MatrixXd first = field_design(set_, along_first).rightCols<3>();
  const Eigen::MatrixXd second = field_design(set_, along_second).rightCols<3>();
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    JointAxis axis;
    // Axes of the same weights share one factorisation.
    const bool shared = k > 0 && weights_.col(k) == weights_.col(k - 1);
    axis.design = shared ? state.axes.back().design
                         : std::make_shared<const LeastSquaresDesign>(
                               state.X, weights_.col(k),
                               parameter_names({set_.axes[static_cast<std::size_t>(k)]}));
    axis.root_weights = weights_.col(k).cwiseSqrt();
    axis.estimate = axis.design->estimate(set_.response.col(k));
    axis.residuals = axis.root_weights.cwiseProduct(set_.response.col(k) - state.X * axis.estimate);
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(set_.size(), directions);
    for (Eigen::Index i = 0; i < set_.size(); ++i) {
      const Eigen::Index column = 2 * static_cast<Eigen::Index>(set_.level_of(i));
      change(i, column) = first.row(i).dot(axis.estimate.tail<3>());
      change(i, column + 1) = second.row(i).dot(axis.estimate.tail<3>());
    }
    axis.take_up.resize(4, directions);
    for (Eigen::Index j = 0; j < directions; ++j) {
      axis.take_up.col(j) = axis.design->estimate(change.col(j));
    }
    axis.tangents = axis.root_weights.asDiagonal() * change;
    axis.projected = axis.root_weights.asDiagonal() * (change - state.X * axis.take_up);
    state.axes.push_back(std::move(axis));
  }
  return state;
}

double JointFit::cost(const JointState& state, const Eigen::VectorXd& sigma) {
  double sum = 0.0;
  for (std::size_t k = 0; k < state.axes.size(); ++k) {
    const double s = sigma(static_cast<Eigen::Index>(k));
    sum += state.axes[k].residuals.squaredNorm() / (s * s);
  }
  return sum;
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

JointState JointFit::converged(const std::vector<Eigen::Vector3d>& fields,
                               const Eigen::VectorXd& sigma) const {
  JointState state = at(fields);
  double current = cost(state, sigma);
  for (int round = 0; round < 50; ++round) {
    const Eigen::MatrixXd J = stacked(state, sigma, &JointAxis::projected);
    Eigen::VectorXd r(J.rows());
    for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
      r.segment(k * set_.size(), set_.size()) =
          state.axes[static_cast<std::size_t>(k)].residuals / sigma(k);
    }
    // A direction that b and S take up stays where it is.
    Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const double whole = stacked(state, sigma, &JointAxis::tangents).norm();
    if (!(svd.singularValues()(0) > confounded_below * whole)) {
      break;
    }
    svd.setThreshold(confounded_below * whole / svd.singularValues()(0));
    Eigen::VectorXd step = svd.solve(r);
    constexpr double longest_step_rad = 0.5;
    step *= std::min(1.0, longest_step_rad / std::max(step.norm(), 1e-300));
    bool better = false;
    for (int halving = 0; halving < 30 && !better; ++halving) {
      std::vector<Eigen::Vector3d> next_fields;
      for (std::size_t s = 0; s < state.fields.size(); ++s) {
        const double F = state.fields[s].norm();
        const Eigen::Vector2d own = step.segment<2>(2 * static_cast<Eigen::Index>(s));
        next_fields.emplace_back(F * (state.fields[s] / F + state.tangents[s] * own).normalized());
      }
      JointState next = at(next_fields);
      const double next_cost = cost(next, sigma);
      // Near the minimum the cost's own rounding must not stop the last steps.
      better = next_cost <= (1.0 + 1e-12) * current;
      if (better) {
        state = std::move(next);
        current = next_cost;
      } else {
        step *= 0.5;
      }
    }
    if (!better || step.norm() < 1e-14) {
      break;
    }
  }
  return state;
}

DirectionShares JointFit::shares(const JointState& state, const Eigen::VectorXd& sigma) const {
  const Eigen::MatrixXd T = stacked(state, sigma, &JointAxis::projected);
  const double whole = stacked(state, sigma, &JointAxis::tangents).norm();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(T, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& singular = svd.singularValues();
  const Eigen::VectorXd inverse =
      (singular.array() > confounded_below * whole).select(singular.cwiseInverse(), 0.0);
  const Eigen::MatrixXd root = svd.matrixV() * inverse.asDiagonal();
  DirectionShares shares{.covariance = root * root.transpose(),
                         .degrees_of_freedom = Eigen::VectorXd(set_.axis_count())};
  for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
    const Eigen::MatrixXd part = T.middleRows(k * set_.size(), set_.size()) * root;
    shares.degrees_of_freedom(k) =
        static_cast<double>(state.axes[static_cast<std::size_t>(k)].design->observations()) - 4.0 -
        part.squaredNorm();
  }
  return shares;
}

Eigen::MatrixXd JointFit::jacobian(const JointState& state, const Eigen::VectorXd& sigma) const {
  const Eigen::Index n = set_.size();
  const Eigen::Index m = set_.axis_count();
  const Eigen::Index directions = state.direction_count();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(n * m, 4 * m + directions);
  for (Eigen::Index k = 0; k < m; ++k) {
    const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
    J.block(n * k, 4 * k, n, 4) = axis.root_weights.asDiagonal() * state.X / sigma(k);
    J.block(n * k, 4 * m, n, directions) = axis.tangents / sigma(k);
  }
  return J;
}

std::optional<Eigen::Vector3d> linear_direction(const ReadingSet& set,
                                                const std::vector<Eigen::Index>& rows) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (n < 10) {
    return std::nullopt;
  }
  Eigen::MatrixXd Z(n, 10);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(rows[static_cast<std::size_t>(i)]);
    const Eigen::Matrix3d R = set.readings[at].level * set.rotation_sensor_from_table[at];
    Z(i, 0) = 1.0;
    Z.row(i).tail<9>() = R.reshaped().transpose();
  }
  if (!undetermined_columns(Z).empty()) {
    return std::nullopt;
  }
  Eigen::MatrixXd M(3 * set.axis_count(), 3);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::VectorXd weights = set.weights.col(k)(rows);
    const Eigen::VectorXd response = set.response.col(k)(rows);
    M.middleRows<3>(3 * k) =
        LeastSquaresDesign(Z, weights).estimate(response).tail<9>().reshaped(3, 3);
  }
  return Eigen::JacobiSVD<Eigen::MatrixXd>(M, Eigen::ComputeThinV).matrixV().col(0);
}

}  // namespace axiscal
