// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "calib/fit/design_advice.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/method_fit.hpp"
#include "calib/fit/model.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/fit/src/opposite_pairs.hpp"
#include "calib/fit/transfer.hpp"

namespace axiscal {
namespace {

// Fits all axes for the field. If readings leave coefficients undetermined, the error message names
// the design points to add.
std::shared_ptr<const Solution> determined_state(const ReadingSet& set,
                                                 const TableField& field,
                                                 const Eigen::MatrixXd& design) {
  const auto throw_rank_deficient = [&] {
    if (set.visible.empty()) {
      require_determined(set, design,
                         field.has_vectors() ? rows_of_points(set, field) : RowsForPoint());
    }
  };
  std::shared_ptr<const Solution> state;
  try {
    const Model model(set, true);
    state =
        model.solved(model.at(model.start(field)), Eigen::VectorXd::Ones(set.axis_count())).state;
  } catch (const RankDeficientError&) {
    throw_rank_deficient();
    require_response(set);  // its message about a dead axis is clearer than one about undetermined
                            // coefficients
    throw;
  }
  // If a pivot is below this limit, the design is also checked without weights and without columns
  // for drift, steps and blocks. With larger pivots, this check would always pass.
  constexpr double clearly_determined = 1e-4;
  if (!std::all_of(state->axes.begin(), state->axes.end(), [](const AxisSolution& axis) {
        return axis.design->smallest_pivot() > clearly_determined;
      })) {
    throw_rank_deficient();
  }
  return state;
}

std::vector<AxisRegression> fitted_axes(const ReadingSet& set, const Solution& state) {
  std::vector<AxisRegression> all;
  all.reserve(static_cast<std::size_t>(set.axis_count()));
  for (Eigen::Index first = 0; first < set.axis_count();) {
    const Eigen::Index count = set.end_of_alike(first, set.weights) - first;
    const AxisSolution& axis = state.axes[static_cast<std::size_t>(first)];
    std::vector<AxisRegression> alike =
        regress({.set = set,
                 .first = first,
                 .factored = *axis.design,
                 .design = axis.X(),
                 .weights = set.weights.col(first),
                 .responses = set.response.middleCols(first, count),
                 .names = [&](Eigen::Index k) { return set.names_of_axis(k); }});
    std::move(alike.begin(), alike.end(), std::back_inserter(all));
    first += count;
  }
  return all;
}

}  // namespace

Estimate estimate_known(const ReadingSet& given, const TableField& field) {
  const Eigen::MatrixXd design = field_design(given, field);
  const Eigen::Matrix3Xd seen = seen_directions(given, field, design);
  if (seen.cols() > 0) {
    Estimate estimate = estimate_transfer(given, design, seen);
    estimate.field = field;
    return estimate;
  }
  std::shared_ptr<const Solution> state = determined_state(given, field, design);
  require_response(given);
  const std::optional<ReadingSet> over_temperature = with_scales_of(given, state->place);
  const ReadingSet& set = over_temperature ? *over_temperature : given;
  const std::vector<AxisRegression> axes = fitted_axes(set, *state);
  // For longer runs it is better to factor the design again than to keep the solution in memory.
  constexpr Eigen::Index long_run = 10000;
  if (!set.is_final() || set.size() > long_run) {
    state.reset();
  }
  Estimate estimate = summarize(set, axes, rows_of_readings(set));
  estimate.mean_field = mean_length_of_fields(design);
  estimate.field = field;
  estimate.solution = std::move(state);
  if (field.has_vectors() && !set.field.is_sum() && !set.has_excluded_readings()) {
    put_levelness(set, field.magnitude(), estimate);
  }
  return estimate;
}

namespace {

Estimate fitted_known(const ReadingSet& readings, bool by_field) {
  return estimate_known(readings, by_field ? readings.field : stated_field(readings.field));
}

}  // namespace

MethodFit known_method() {
  return {.method = Method::known, .fitted = fitted_known};
}

// Returns method faces. Its fit takes the stated faces as exact; fit_face_lengths() later replaces
// the result.
MethodFit faces_method() {
  return {.method = Method::faces, .fitted = fitted_known};
}

}  // namespace axiscal
