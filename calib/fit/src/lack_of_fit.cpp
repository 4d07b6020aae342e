// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/lack_of_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/fit/model.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index most_poses = 300;

// For one axis: the mean reading of each pose, and the mean rows of the design and of the
// derivatives with respect to the errors of the inputs.
struct PoseMeans {
  Eigen::VectorXd weights;
  Eigen::VectorXd response;
  Eigen::MatrixXd design;
  Eigen::MatrixXd errors;
};

// Computes the weighted means of an axis.
// @param tangents  columns for the field's direction, already multiplied by the roots of the
//                  weights.
PoseMeans means_of_axis(const ReadingSet& set,
                        const std::vector<int>& group,
                        const AxisSolution& axis,
                        Eigen::Index k,
                        const Eigen::MatrixXd& tangents,
                        const Eigen::MatrixXd& errors) {
  const Eigen::Index poses = 1 + *std::max_element(group.begin(), group.end());
  const Eigen::Index p = set.coefficient_count();
  PoseMeans means{.weights = Eigen::VectorXd::Zero(poses),
                  .response = Eigen::VectorXd::Zero(poses),
                  .design = Eigen::MatrixXd::Zero(poses, p + tangents.cols()),
                  .errors = Eigen::MatrixXd::Zero(poses, errors.cols())};
  // Shifts between blocks, steps and drift do not depend on the pose, so their fitted values are
  // subtracted.
  const Eigen::Index effects = set.effects.columns.cols();
  const Eigen::VectorXd of_effects = axis.X().rightCols(effects) * axis.estimate.tail(effects);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const double w = set.weights(i, k);
    const Eigen::Index pose = group[static_cast<std::size_t>(i)];
    means.weights(pose) += w;
    means.response(pose) += w * (set.response(i, k) - of_effects(i));
    means.design.row(pose).head(p) += w * axis.X().row(i).head(p);
    means.errors.row(pose) += w * errors.row(i);
    if (w > 0.0) {
      means.design.row(pose).tail(tangents.cols()) += std::sqrt(w) * tangents.row(i);
    }
  }
  std::vector<Eigen::Index> seen;
  for (Eigen::Index pose = 0; pose < poses; ++pose) {
    if (means.weights(pose) > 0.0) {
      seen.push_back(pose);
    }
  }
  const Eigen::VectorXd per_weight = means.weights(seen).cwiseInverse();
  return {.weights = means.weights(seen),
          .response = per_weight.cwiseProduct(means.response(seen)),
          .design = per_weight.asDiagonal() * means.design(seen, Eigen::all),
          .errors = per_weight.asDiagonal() * means.errors(seen, Eigen::all)};
}

void test_axis(const PoseMeans& means, LackOfFit& test) {
  const Eigen::VectorXd of_scatter =
      test.pure_error_sd * test.pure_error_sd * means.weights.cwiseInverse();
  Eigen::MatrixXd V = means.errors * means.errors.transpose();
  V.diagonal() += of_scatter;
  const Whitening whitening(V);
  if (!whitening.is_valid()) {
    return;
  }
  const Eigen::MatrixXd X = whitening.times(means.design);
  const Eigen::VectorXd y = whitening.times(means.response);
  const auto [inverse, rank] = pseudo_inverse_with_rank(X);
  const auto free = static_cast<double>(X.rows() - rank);
  if (!(free > 0.0)) {
    return;
  }
  // M projects onto the directions orthogonal to the design. `share` is the mean fraction of the
  // variance in these directions that comes from the scatter of the readings.
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(X.rows(), X.rows()) - X * inverse;
  const Eigen::MatrixXd back = whitening.transposed_times(M);
  const double share = (back.cwiseAbs2().array().colwise() * of_scatter.array()).sum() / free;
  test.lack_of_fit_dof = free;
  test.f = (M * y).squaredNorm() / free;
  test.p_value = f_upper_p(std::max(test.f, 1e-300), free, test.pure_error_dof / (share * share));
}

}  // namespace

void test_lack_of_fit_of_inputs(const Experiment& experiment,
                                const ReadingSet& set,
                                Method method,
                                Estimate& estimate) {
  std::vector<LackOfFit>& tests = estimate.statistics.lack_of_fit;
  if (tests.empty() || !estimate.field.has_vectors() || set.rotation_sensor_from_table.empty() ||
      set.robust) {
    return;
  }
  const bool known = method_kind(method).directions_known;
  const std::vector<InputQuantity> inputs =
      input_quantities(experiment, set, known, estimate.field);
  if (inputs.empty()) {
    return;
  }
  const std::vector<int> group = groups_of_readings(set);
  if (*std::max_element(group.begin(), group.end()) >= static_cast<int>(most_poses)) {
    return;
  }
  const std::shared_ptr<const Solution> at = Model(set, known).at({.field = estimate.field});
  const Solution& state = *at;
  Eigen::Index count = 0;
  for (const InputQuantity& input : inputs) {
    count += input.parts;
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    LackOfFit& test = tests[static_cast<std::size_t>(k)];
    if (!(test.pure_error_dof > 0.0) || !(test.pure_error_sd > 2.0 * set.rounding(k))) {
      continue;
    }
    Eigen::MatrixXd errors(set.size(), count);
    const Eigen::RowVector3d S = estimate.response.sensitivity.row(k);
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      Eigen::Index first = 0;
      for (const InputQuantity& input : inputs) {
        errors.block(i, first, 1, input.parts) =
            set.scale(i, k) * S * input.change(i, k, estimate.field);
        first += input.parts;
      }
    }
    const AxisSolution& axis = state.axes[static_cast<std::size_t>(k)];
    test_axis(means_of_axis(set, group, axis, k, axis.shared, errors), test);
  }
}

}  // namespace axiscal
