// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "axiscal/calib/robust.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/design_advice.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/method_fit.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/fit/src/joint_solution.hpp"
#include "calib/fit/src/joint_start.hpp"
#include "calib/fit/src/opposite_pairs.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/reweighting.hpp"

namespace axiscal {
namespace {

// Bisquare weights for all axes, and the axes' robust standard deviations.
struct RobustRound {
  Eigen::MatrixXd weights;
  Eigen::VectorXd sigma;
};

RobustRound robust_round(const ReadingSet& set,
                         const Solution& state,
                         const Eigen::MatrixXd& leverage,
                         const Eigen::VectorXd& degrees_of_freedom) {
  RobustRound round{.weights = Eigen::MatrixXd(set.size(), set.axis_count()),
                    .sigma = Eigen::VectorXd(set.axis_count())};
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const AxisSolution& axis = state.axes[static_cast<std::size_t>(k)];
    const Eigen::VectorXd residuals =
        set.weights.col(k).cwiseSqrt().cwiseProduct(set.response.col(k) - axis.X() * axis.estimate);
    const BisquareWeights bisquare = bisquare_weights(
        residuals, leverage.col(k),
        static_cast<double>(axis.design->observations()) - degrees_of_freedom(k), set.rounding(k));
    round.weights.col(k) = bisquare.weights;
    round.sigma(k) =
        std::max(bisquare.scale * std::sqrt(bisquare.variance_factor), set.rounding(k));
  }
  return round;
}

// Linearises the model about a solution.
Fit linearised(const ReadingSet& set, const JointSolution& solution) {
  return {set, solution.state, solution.sigma};
}

Estimate robust_estimate(const ReadingSet& set, const Model& given, const JointSolution& plain) {
  require_robust_freedom(plain.shares.degrees_of_freedom.minCoeff());
  const Eigen::MatrixXd leverage =
      describe_joint(set, plain, Eigen::MatrixXd::Ones(set.size(), set.axis_count()))
          .statistics.leverage;
  std::shared_ptr<const Solution> state = plain.state;
  Eigen::VectorXd sigma = plain.sigma;
  const Eigen::MatrixXd robust = reweight_until_converged(
      set.size(), set.axis_count(),
      [&] {
        RobustRound next = robust_round(set, *state, leverage, plain.shares.degrees_of_freedom);
        sigma = next.sigma;
        return std::move(next.weights);
      },
      [&](const Eigen::MatrixXd& robust_weights) {
        const Eigen::MatrixXd weights = set.weights.cwiseProduct(robust_weights);
        const Model reweighted(given.readings(), false, weights);
        state = reweighted.solved(reweighted.at(state->place), sigma).state;
      });
  // The covariance uses the robust standard deviations, but not the robust weights. The estimate
  // and the residuals are those of the robust fit.
  const auto robust_state = std::make_shared<Solution>(*given.at(state->place));
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    AxisSolution& axis = robust_state->axes[static_cast<std::size_t>(k)];
    axis.estimate = state->axes[static_cast<std::size_t>(k)].estimate;
    axis.residuals =
        axis.root_weights().cwiseProduct(set.response.col(k) - axis.X() * axis.estimate);
  }
  robust_state->find_sums();
  const JointSolution solution{
      .state = robust_state, .sigma = sigma, .shares = Model::cost_of_shared(*robust_state, sigma)};
  Estimate estimate = describe_joint(set, solution, robust);
  const Fit run = linearised(set, solution);
  const std::optional<double> small = condition_from_normal_matrix(run.information());
  estimate.statistics.condition_number = small ? *small : condition_of(run.columns());
  return estimate;
}

// Determines the sign of the field. The readings do not determine it, because a reversed field with
// reversed sensitivities fits equally well. If a direction of the field is stated, the sign follows
// from it. Otherwise it follows from the expected signs of the sensitivities.
// @return true if the fields must be reversed; nullopt if neither criterion determines the sign.
std::optional<bool> is_reversed(const ReadingSet& set,
                                const Solution& state,
                                const std::vector<FieldDescription>& parts) {
  double given = 0.0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    given += state.field().vector(p).normalized().dot(parts[p].start.sign_by);
  }
  if (given != 0.0) {
    return given < 0.0;
  }
  double expected = 0.0;
  for (std::size_t k = 0; k < set.nominal.size(); ++k) {
    if (set.nominal[k]) {
      const Eigen::Vector3d S = state.axes[k].estimate.segment<3>(1);
      expected += S(*set.nominal[k]) / S.norm();
    }
  }
  constexpr double clear = 0.5;
  if (std::abs(expected) > clear) {
    return expected < 0.0;
  }
  return std::nullopt;
}

}  // namespace

Estimate estimate_joint(const ReadingSet& set) {
  std::vector<TableField> all_starts = start_fields(set);
  if (set.has_excluded_readings() && set.visible.empty() && all_starts.size() == 1) {
    // If a lamp is stated exactly on the cube's diagonal, the coefficients of one-sided axes are
    // undetermined. The search then starts from a nearby direction, provided that the coefficients
    // are determined there. The condition number of the result shows how well they are determined.
    constexpr double a_little_rad = 0.01;
    std::vector<Eigen::Vector3d> turned = all_starts.front().vectors();
    for (Eigen::Vector3d& vector : turned) {
      vector = rotation_by(a_little_rad * tangents_of(vector).col(0)) * vector;
    }
    TableField beside = all_starts.front().with(std::move(turned));
    if (open_parameters(set, field_design(set, beside)).names.empty()) {
      all_starts.front() = std::move(beside);
    }
  }
  if (set.visible.empty()) {
    require_determined(set, field_design(set, all_starts.front()),
                       rows_of_points(set, all_starts.front()));
  }
  require_response(set);
  const Model model(set, false);
  BestSolution best = best_solution(set, model, all_starts);
  JointSolution& solution = best.solution;
  const std::optional<bool> turn = is_reversed(set, *solution.state, set.field.parts());
  if (turn.value_or(false)) {
    Place reversed = solution.state->place;
    reversed.field = reversed.field.reversed();
    reversed.along = -reversed.along;
    solution.state = model.at(reversed);
    solution.shares = Model::cost_of_shared(*solution.state, solution.sigma);
  } else if (!turn) {
    best.ambiguity =
        "the field and all sensitivities may have the opposite sign, because the direction of the "
        "field is not stated";
  }
  const std::optional<ReadingSet> over_temperature = with_scales_of(set, solution.state->place);
  const ReadingSet& fitted = over_temperature ? *over_temperature : set;
  std::optional<double> condition_number =
      condition_from_normal_matrix(linearised(fitted, solution).information());
  if (!condition_number) {
    const Fit run = linearised(fitted, solution);
    require_direction(run, solution);
    condition_number = condition_of(run.columns());
  }
  require_degrees_of_freedom(set, solution);
  Estimate estimate;
  if (set.robust) {
    estimate = robust_estimate(fitted, model, solution);
  } else {
    estimate = describe_joint(fitted, solution, Eigen::MatrixXd());
    estimate.statistics.condition_number = *condition_number;
    if (set.is_final()) {
      estimate.solution = solution.state;
    }
  }
  estimate.direction.ambiguity = std::move(best.ambiguity);
  if (!set.field.is_sum() && !set.has_excluded_readings()) {
    put_levelness(fitted, set.field.parts().front().magnitude, estimate);
  }
  return estimate;
}

MethodFit joint_method() {
  return {.method = Method::joint,
          .fitted = [](const ReadingSet& readings, bool) { return estimate_joint(readings); }};
}

}  // namespace axiscal
