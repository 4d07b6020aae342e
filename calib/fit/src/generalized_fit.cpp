// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/generalized_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "axiscal/calib/covariance_root.hpp"
#include "axiscal/calib/joint_fit.hpp"
#include "axiscal/calib/mixed_model.hpp"
#include "axiscal/calib/response_system.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

// By all inputs' errors beside each other.
FieldChanges changes_with_inputs(const std::vector<UncertainInput>& inputs,
                                 Eigen::Index readings,
                                 const std::vector<Eigen::Vector3d>& fields) {
  FieldChanges changes;
  for (Eigen::Index i = 0; i < readings; ++i) {
    Eigen::Matrix3Xd all(3, 0);
    for (const UncertainInput& input : inputs) {
      all.conservativeResize(3, all.cols() + input.parts);
      all.rightCols(input.parts) = input.change(i, fields);
    }
    changes.push_back(std::move(all));
  }
  return changes;
}

// How many of an axis's readings the fit leaves free, and the degrees of freedom of their scatter.
struct AxisFreedom {
  double free = 0.0;
  double degrees_of_freedom = 0.0;
};

AxisFreedom freedom_of(const Eigen::Ref<const Eigen::MatrixXd>& rows,
                       const Eigen::MatrixXd& covariance,
                       double used) {
  const Eigen::MatrixXd N = rows.transpose() * rows;
  const Eigen::MatrixXd CN = covariance * N;
  const double free = used - CN.trace();
  return {.free = free, .degrees_of_freedom = free - CN.trace() + (CN * CN).trace()};
}

// Each axis's scatter to begin with: that of the fit, or 1e-9 of its response where nothing
// scatters.
Eigen::VectorXd first_scatter(const Estimate& estimate, const Eigen::MatrixXd& theta) {
  Eigen::VectorXd sigma = estimate.statistics.residual_sd;
  for (Eigen::Index k = 0; k < sigma.size(); ++k) {
    if (!(sigma(k) > 0.0)) {
      sigma(k) = 1e-9 * theta.col(k).segment<3>(1).norm() * estimate.fields.front().norm();
    }
  }
  return sigma;
}

// What each input adds to the coefficients' covariance.
// @param to_all  the coefficients by the columns of the system; the inputs' begin with `first`.
std::vector<Eigen::MatrixXd> shares_of(const std::vector<UncertainInput>& inputs,
                                       const Eigen::MatrixXd& to_all,
                                       Eigen::Index first) {
  std::vector<Eigen::MatrixXd> shares;
  for (const UncertainInput& input : inputs) {
    const Eigen::MatrixXd to_input = to_all.middleCols(first, input.parts);
    shares.emplace_back(to_input * to_input.transpose());
    first += input.parts;
  }
  return shares;
}

}  // namespace

Eigen::Matrix<double, 3, 18> change_with_normals(
    const Eigen::Matrix3d& rotation_table_from_positioner,
    const DesignPoint& point,
    const Eigen::Vector3d& field_in_table) {
  const Eigen::Vector3d x = rotation_table_from_positioner.row(0);
  const Eigen::Vector3d y = rotation_table_from_positioner.row(1);
  const Eigen::Vector3d z = rotation_table_from_positioner.row(2);
  const Eigen::Vector3d& f = field_in_table;
  Eigen::Matrix<double, 3, 18> change = Eigen::Matrix<double, 3, 18>::Zero();
  change.middleCols<3>(3 * static_cast<Eigen::Index>(point.rest())) =
      -f.z() * Eigen::Matrix3d::Identity() + f.y() * z * y.transpose() + f.x() * z * x.transpose();
  change.middleCols<3>(3 * static_cast<Eigen::Index>(point.fence())) =
      f.y() * x * x.transpose() - f.x() * y * x.transpose();
  return change;
}

std::vector<UncertainInput> uncertain_inputs(const Experiment& experiment,
                                             const ReadingSet& set,
                                             bool known_field,
                                             const std::vector<Eigen::Vector3d>& fields) {
  std::vector<UncertainInput> inputs;
  if (fields.empty()) {
    return inputs;
  }
  const auto& covariance = experiment.positioner.description().normal_covariance;
  if (covariance && !covariance->isZero(0.0)) {
    inputs.push_back({.name = "positioner",
                      .u = not_a_number,
                      .parts = covariance->cols(),
                      .change = [&set, &positioner = experiment.positioner,
                                 &mount = experiment.rotation_sensor_from_positioner,
                                 root = covariance_root(*covariance)](
                                    Eigen::Index i, const std::vector<Eigen::Vector3d>& f) {
                        const DesignPoint& point = *set.readings[static_cast<std::size_t>(i)].point;
                        return Eigen::Matrix3Xd(
                            mount *
                            change_with_normals(positioner.rotation_table_from_positioner(point),
                                                point, set.field_in_table(i, f)) *
                            root);
                      }});
  }
  const auto add_turns = [&](const char* name, double u, const Eigen::Matrix<double, 3, 2>& axes) {
    inputs.push_back(
        {.name = name,
         .u = u,
         .unit = "rad",
         .parts = axes.cols(),
         .change = [&set, u, axes](Eigen::Index i, const std::vector<Eigen::Vector3d>& f) {
           const Eigen::Vector3d field = set.field_in_table(i, f);
           // w cross f = -(f cross w).
           return Eigen::Matrix3Xd(set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                                   (-u * cross_matrix(field) * axes));
         }});
  };
  if (known_field && experiment.stated.slope_u > 0.0) {
    // A slope turns the field about the table's x and y.
    add_turns("levelness", experiment.stated.slope_u, Eigen::Matrix<double, 3, 2>::Identity());
  }
  if (known_field && experiment.stated.direction_u_rad > 0.0) {
    add_turns("field direction", experiment.stated.direction_u_rad, tangents_of(fields.front()));
  }
  return inputs;
}

std::optional<std::vector<Eigen::MatrixXd>> fit_with_uncertain_inputs(
    const ReadingSet& set,
    const std::vector<UncertainInput>& inputs,
    bool known_field,
    Estimate& estimate) {
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  const Eigen::Index errors =
      std::accumulate(inputs.begin(), inputs.end(), Eigen::Index{0},
                      [](Eigen::Index sum, const UncertainInput& one) { return sum + one.parts; });
  const JointFit fit(set, set.weights);
  JointState state = fit.at(estimate.fields);
  const Eigen::Index directions = known_field ? 0 : state.direction_count();
  Eigen::MatrixXd theta(p, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    theta.col(k) = state.axes[static_cast<std::size_t>(k)].estimate;
  }
  Eigen::VectorXd sigma = first_scatter(estimate, theta);
  std::vector<Eigen::Vector3d> fields = estimate.fields;
  Eigen::MatrixXd W;
  std::optional<MixedModelFit> model;
  Eigen::VectorXd dof = Eigen::VectorXd::Zero(m);
  constexpr int most_rounds = 100;
  for (int round = 0; round < most_rounds; ++round) {
    if (round > 0) {
      state = fit.at(fields);
    }
    const FieldChanges by_inputs = changes_with_inputs(inputs, n, fields);
    std::vector<Eigen::MatrixXd> own;
    std::vector<Eigen::MatrixXd> shared;
    Eigen::VectorXd left(n * m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const JointAxis& axis = state.axes[static_cast<std::size_t>(k)];
      const Eigen::VectorXd root = axis.root_weights / sigma(k);
      own.emplace_back(root.asDiagonal() * axis.X);
      Eigen::MatrixXd& columns = shared.emplace_back(n, directions + errors);
      columns << axis.tangents.leftCols(directions) / sigma(k),
          root.asDiagonal() *
              response_changes(set, k, theta.col(k).segment<3>(1).transpose(), by_inputs);
      left.segment(n * k, n) = root.cwiseProduct(set.response.col(k) - axis.X * theta.col(k));
    }
    W = stacked_by_axis(own, shared);
    model = fit_mixed_model(W, left, errors);
    if (!model) {
      return std::nullopt;
    }
    double change = 0.0;
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto used = static_cast<double>((set.weights.col(k).array() > 0.0).count());
      const AxisFreedom freedom = freedom_of(W.middleRows(n * k, n), model->covariance, used);
      if (!(freedom.free > 0.5)) {
        return std::nullopt;
      }
      dof(k) = freedom.degrees_of_freedom;
      const double factor =
          std::sqrt(model->residuals.segment(n * k, n).squaredNorm() / freedom.free);
      const double next = std::max(sigma(k) * factor, set.rounding(k));
      change = std::max(change, std::abs(next / sigma(k) - 1.0));
      sigma(k) = next;
      theta.col(k) += model->estimate.segment(p * k, p);
    }
    if (directions > 0) {
      fields = moved_fields(fields, state.tangents, model->estimate.segment(p * m, directions));
    }
    if (change < 1e-9 && round > 1) {
      break;
    }
  }
  estimate.fields = fields;
  estimate.statistics.residual_sd = sigma;
  estimate.statistics.degrees_of_freedom = dof;
  for (Eigen::Index k = 0; k < m; ++k) {
    put_coefficients(set, k, theta.col(k), estimate);
  }
  const Eigen::MatrixXd to_all = model->covariance.topRows(p * m);
  estimate.statistics.covariance = to_all * (W.transpose() * W) * to_all.transpose();
  return shares_of(inputs, to_all, p * m + directions);
}

std::vector<UncertaintySource> weigh_inputs(const Experiment& experiment,
                                            const ReadingSet& set,
                                            Method method,
                                            Estimate& estimate) {
  const bool known = method == Method::known;
  const std::vector<UncertainInput> inputs =
      uncertain_inputs(experiment, set, known, estimate.fields);
  if (inputs.empty()) {
    return {};
  }
  const bool has_normals = inputs.front().name == "positioner";
  if (experiment.robust) {
    if (has_normals) {
      estimate.notes.emplace_back(
          "robust regression does not weigh the uncertainty of the cube's face normals; the stated "
          "uncertainties lack it");
    }
    return {};
  }
  ReadingSet used = set;
  for (const std::size_t i : estimate.unpaired) {
    used.weights.row(static_cast<Eigen::Index>(i)).setZero();
  }
  std::optional<std::vector<Eigen::MatrixXd>> shares =
      fit_with_uncertain_inputs(used, inputs, known, estimate);
  if (!shares) {
    if (has_normals) {
      estimate.notes.emplace_back(
          "the readings do not tell the errors of the cube's faces from noise; the stated "
          "uncertainties lack that of its face normals");
    }
    return {};
  }
  std::vector<UncertaintySource> sources;
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    sources.push_back({.name = inputs[s].name,
                       .type = "B",
                       .distribution = "normal",
                       .input_u = inputs[s].u,
                       .input_unit = inputs[s].unit,
                       .degrees_of_freedom = std::numeric_limits<double>::infinity(),
                       .covariance = std::move((*shares)[s])});
  }
  return sources;
}

}  // namespace axiscal
