// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "calib/mistakes/src/mistake_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array bias_step_advice = {MistakeAdvice{
    .code = WarningCode::bias_step,
    .one = "Look for a knock, a loose cable or a changed range between these readings, and take "
           "the readings again.",
    .many = {}}};

// A step of the bias of one axis between two readings of a block. It lasts to the end of the block.
struct Step {
  std::size_t cut = 0;  // index in run.order() of the first reading after the step
  Eigen::Index axis = 0;
  double drop = 0.0;  // reduction of the sum of squares, to first order
};

constexpr std::size_t most_fitted = 4;
// The smallest number of readings of a block before and after a step. A step of a single reading is
// treated as an outlier.
constexpr double fewest_beside = 2.0;

int block_at(const SuspectRun& run, std::size_t at) {
  return run.set().readings[run.order()[at]].block;
}

// Returns the index in run.order() at which the next block begins.
// @param at  an index in run.order() within the present block.
std::size_t end_of_block(const SuspectRun& run, std::size_t at) {
  std::size_t end = at;
  while (end < run.count() && block_at(run, end) == block_at(run, at)) {
    ++end;
  }
  return end;
}

// Adds the steps of one axis within one block. A cut is the index in run.order() of the first
// reading after a step. The column of a step is 1 for the readings from the cut to the end of the
// block, so each earlier cut adds one reading to the column. Therefore the column's products with
// the basis and with the residuals are computed as running sums.
void add_steps(const SuspectRun& run,
               const HypothesisFit& fit,
               Eigen::Index axis,
               std::size_t first,
               std::size_t end,
               std::vector<Step>& steps) {
  Eigen::MatrixXd in_basis = Eigen::MatrixXd::Zero(fit.fit->column_count(), 1);
  double squares = 0.0;
  double product = 0.0;
  double behind = 0.0;
  for (std::size_t cut = end - 1; cut > first; --cut) {
    const auto row = static_cast<Eigen::Index>(run.order()[cut]);
    const double z = std::sqrt(run.set().weights(row, axis)) / run.fitter().scale()(axis);
    fit.fit->add_in_basis(axis, row, Eigen::Matrix<double, 1, 1>(z), in_basis);
    squares += z * z;
    product += z * fit.residuals(row, axis);
    behind += 1.0;
    const double left = squares - in_basis.squaredNorm();
    if (behind >= fewest_beside && static_cast<double>(cut - first) >= fewest_beside &&
        left > 1e-9 * squares) {
      steps.push_back({.cut = cut, .axis = axis, .drop = product * product / left});
    }
  }
}

// Returns all steps, sorted by the reduction of the sum of squares, the largest first.
std::vector<Step> steps_of(const SuspectRun& run, const HypothesisFit& fit) {
  std::vector<Step> steps;
  if (run.set().temperature.order > 0) {
    return steps;  // an error of the temperature polynomials could look like a step
  }
  for (std::size_t first = 0; first < run.count();) {
    const std::size_t end = end_of_block(run, first);
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      add_steps(run, fit, k, first, end, steps);
    }
    first = end;
  }
  std::stable_sort(steps.begin(), steps.end(),
                   [](const Step& a, const Step& b) { return a.drop > b.drop; });
  return steps;
}

std::span<const Step> likeliest(const std::vector<Step>& steps) {
  return std::span(steps).first(std::min(steps.size(), most_fitted));
}

HypothesisFit fit_step(const SuspectRun& run, const Step& step) {
  return run.fitter().fit(run.set(), {}, [&](const auto&, const auto&) -> Eigen::MatrixXd {
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), 1);
    const std::size_t end = end_of_block(run, step.cut);
    for (std::size_t at = step.cut; at < end; ++at) {
      Z(run.n() * step.axis + static_cast<Eigen::Index>(run.order()[at]), 0) = 1.0;
    }
    return Z;
  });
}

double quick_p_of_step(const SuspectRun& run, const HypothesisFit& fit) {
  const std::vector<Step> steps = steps_of(run, fit);
  return steps.empty() ? 1.0
                       : static_cast<double>(steps.size()) *
                             nested_f_p(fit.total(), fit.dof(), steps.front().drop, 1.0);
}

void detect_step(const SuspectRun& run, const Consider& consider) {
  const std::vector<Step> steps = steps_of(run, run.plain());
  for (const Step& step : likeliest(steps)) {
    consider(fit_step(run, step), {.tests = static_cast<double>(steps.size()), .of_few = true});
  }
}

void explain_by_step(const SuspectRun& run, Explanations& found) {
  const std::vector<Step> steps = steps_of(run, run.plain());
  for (const Step& step : likeliest(steps)) {
    found.add(
        fit_step(run, step), {drift_range * run.full_response(step.axis)},
        static_cast<double>(steps.size()),
        about(run, WarningCode::bias_step, {run.order()[step.cut - 1], run.order()[step.cut]}),
        formatted("with a step in the bias of axis {} between them",
                  run.set().axes[static_cast<std::size_t>(step.axis)]));
  }
}

}  // namespace

MistakeKind bias_step_kind() {
  return {.advice = bias_step_advice,
          .of_run = explain_by_step,
          .quick_p = quick_p_of_step,
          .detect = detect_step};
}

}  // namespace axiscal
