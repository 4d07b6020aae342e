// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/fit/src/causes/noise_parts.hpp"
#include "calib/regression/serial_correlation.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the readings in their order, for the test of correlation. The design omits the columns of
// the blocks, because shifts between blocks are a kind of correlation. Returns nullopt if the
// readings have different weights, or if there are too few readings.
std::optional<OrderedReadings> ordered_readings(const ReadingSet& set, const Estimate& estimate) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto weights = set.weights.row(i).array();
    const std::vector<int>& blocks = set.effects.blocks;
    const bool taken_again =
        !set.effects.small_blocks.empty() &&
        std::find(blocks.begin(), blocks.end(), set.readings[static_cast<std::size_t>(i)].block) ==
            blocks.end();
    if ((weights == 0.0).any() || taken_again) {
      continue;
    }
    constexpr double as_one = 1e-9;
    if (((weights - set.weights.row(rows.empty() ? i : rows.front()).array()).abs() > as_one)
            .any()) {
      return std::nullopt;
    }
    rows.push_back(i);
  }
  constexpr Eigen::Index fewest_left = 4;
  const Eigen::Index within = set.effects.columns_within_blocks();
  const Eigen::Index p = set.coefficient_count() + within;
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (n < p + fewest_left) {
    return std::nullopt;
  }
  const AxisDesigns designs(set, estimate.field);
  OrderedReadings ordered;
  ordered.responses = set.response(rows, Eigen::all);
  ordered.places.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!set.effects.blocks.empty()) {
      ordered.blocks.push_back(
          set.readings[static_cast<std::size_t>(rows[static_cast<std::size_t>(i)])].block);
    }
    ordered.places(i) = static_cast<double>(rows[static_cast<std::size_t>(i)]);
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::MatrixXd all = set.all_columns(designs.of(k), k);
    Eigen::MatrixXd& design = ordered.designs.emplace_back(n, p);
    design.leftCols(set.coefficient_count()) = all(rows, Eigen::seqN(0, set.coefficient_count()));
    design.rightCols(within) = all(rows, Eigen::lastN(within));
    if (k == 0 && set.end_of_alike(0, set.weights) == set.axis_count()) {
      break;  // one design for all axes
    }
  }
  return ordered;
}

void add_serial_correlation(const SolvedReadings& run, Estimate& estimate) {
  const ReadingSet& set = run.set();
  const bool has_soaks = estimate.statistics.find_component("soaks") != nullptr;
  if (has_soaks || set.robust || set.seen.cols() > 0) {
    return;  // the cause 'soaks' already includes the error that the readings of a soak share
  }
  const std::optional<OrderedReadings> ordered = ordered_readings(set, estimate);
  const double score = ordered ? lag_one_score(*ordered) : 0.0;
  if (!(score > alike_above)) {
    return;
  }
  const CorrelatedMean mean = uncertainty_of_correlated_mean(*ordered);
  // Fitted seats change the weights of the readings, so that the bias has a smaller uncertainty
  // than that of least squares. The correlation increases both by the same factor.
  Eigen::VectorXd u = mean.u;
  if (const ScatterComponent* const seats = estimate.statistics.find_component("seats")) {
    const Eigen::VectorXd variances =
        (estimate.statistics.covariance_of_readings() + seats->covariance).diagonal();
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      u(k) *= std::sqrt(variances(set.coefficient_count() * k)) / mean.u_if_white(k);
    }
  }
  WiderIntervals wider("correlation", estimate);
  // A smaller correlation may come from shifts of blocks, which the cause 'blocks' includes.
  constexpr double slight = 0.1;
  if (!(mean.correlation > slight)) {
    return;
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    if (!(u(k) > set.rounding(k))) {
      return;
    }
  }
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::Index at = set.coefficient_count() * k;
    wider.component().sd(k) = u(k);
    wider.widen(at, u(k) * u(k), mean.degrees_of_freedom);
  }
  wider.put();
  if (score > told_alike_above) {
    estimate.notes.push_back(
        {NoteCode::correlation,
         formatted("Consecutive readings are correlated (coefficient about {}). The intervals of "
                   "the biases include this correlation",
                   number_text(mean.correlation, 1))});
  }
}

CountedEstimate counted_correlation(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  with_layings(run, so_far, [&](const SolvedReadings& readings) {
    add_serial_correlation(readings, so_far.estimate);
  });
  return so_far;
}

}  // namespace

Cause correlation_cause() {
  return {.name = "correlation", .counted = counted_correlation};
}

}  // namespace axiscal
