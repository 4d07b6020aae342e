// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
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

// A step of the bias of one axis, or of all axes together, between two readings of a block. It
// lasts to the end of the block.
struct Step {
  std::size_t cut = 0;               // index in run.order() of the first reading after the step
  std::optional<Eigen::Index> axis;  // nullopt: all axes
  double drop = 0.0;                 // reduction of the sum of squares, to first order
  double p_value = 1.0;              // of the F test of this reduction

  // Returns the axes whose biases change.
  [[nodiscard]] std::vector<Eigen::Index> axes(Eigen::Index m) const {
    std::vector<Eigen::Index> all(axis ? 1 : static_cast<std::size_t>(m), axis.value_or(0));
    if (!axis) {
      std::iota(all.begin(), all.end(), Eigen::Index{0});
    }
    return all;
  }
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

// Adds a step of all axes for each cut at which every axis has a step.
// @param steps  the steps of single axes in one block.
void add_steps_of_all_axes(const SuspectRun& run,
                           const std::vector<Step>& steps,
                           std::vector<Step>& together) {
  if (run.m() < 2) {
    return;
  }
  std::vector<double> drops(run.count(), 0.0);
  std::vector<Eigen::Index> axes(run.count(), 0);
  for (const Step& step : steps) {
    drops[step.cut] += step.drop;
    if (++axes[step.cut] == run.m()) {
      together.push_back({.cut = step.cut, .axis = {}, .drop = drops[step.cut]});
    }
  }
}

// The steps that are least likely by chance, at most `most_fitted`, the least likely first.
struct LikelySteps {
  std::vector<Step> steps;
  double tested = 0.0;  // number of all steps
};

LikelySteps likely_steps(const SuspectRun& run, const HypothesisFit& fit) {
  LikelySteps found;
  if (run.set().temperature.order > 0) {
    return found;  // an error of the temperature polynomials could look like a step
  }
  std::vector<Step> single;
  std::vector<Step> together;
  for (std::size_t first = 0; first < run.count();) {
    const std::size_t end = end_of_block(run, first);
    std::vector<Step> of_block;
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      add_steps(run, fit, k, first, end, of_block);
    }
    add_steps_of_all_axes(run, of_block, together);
    single.insert(single.end(), of_block.begin(), of_block.end());
    first = end;
  }
  found.tested = static_cast<double>(single.size() + together.size());
  // Among steps of the same number of axes, a larger drop has a smaller p-value.
  for (std::vector<Step>* const steps : {&single, &together}) {
    std::stable_sort(steps->begin(), steps->end(),
                     [](const Step& a, const Step& b) { return a.drop > b.drop; });
    steps->resize(std::min(steps->size(), most_fitted));
    for (Step& step : *steps) {
      const double added = step.axis ? 1.0 : static_cast<double>(run.m());
      step.p_value = nested_f_p(fit.total(), fit.dof(), step.drop, added);
      found.steps.push_back(step);
    }
  }
  std::stable_sort(found.steps.begin(), found.steps.end(),
                   [](const Step& a, const Step& b) { return a.p_value < b.p_value; });
  found.steps.resize(std::min(found.steps.size(), most_fitted));
  return found;
}

HypothesisFit fit_step(const SuspectRun& run, const Step& step) {
  return run.fitter().fit(run.set(), {}, [&](const auto&, const auto&) -> Eigen::MatrixXd {
    const std::vector<Eigen::Index> axes = step.axes(run.m());
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), std::ssize(axes));
    const std::size_t end = end_of_block(run, step.cut);
    for (std::size_t at = step.cut; at < end; ++at) {
      for (std::size_t j = 0; j < axes.size(); ++j) {
        Z(run.n() * axes[j] + static_cast<Eigen::Index>(run.order()[at]),
          static_cast<Eigen::Index>(j)) = 1.0;
      }
    }
    return Z;
  });
}

double quick_p_of_step(const SuspectRun& run, const HypothesisFit& fit) {
  const LikelySteps found = likely_steps(run, fit);
  return found.steps.empty() ? 1.0 : found.tested * found.steps.front().p_value;
}

void detect_step(const SuspectRun& run, const Consider& consider) {
  const LikelySteps found = likely_steps(run, run.plain());
  for (const Step& step : found.steps) {
    consider(fit_step(run, step), {.tests = found.tested, .of_few = true});
  }
}

void explain_by_step(const SuspectRun& run, Explanations& explanations) {
  const LikelySteps found = likely_steps(run, run.plain());
  for (const Step& step : found.steps) {
    std::vector<double> ranges;
    for (const Eigen::Index k : step.axes(run.m())) {
      ranges.push_back(drift_range * run.full_response(k));
    }
    explanations.add(
        fit_step(run, step), ranges, found.tested,
        about(run, WarningCode::bias_step, {run.order()[step.cut - 1], run.order()[step.cut]}),
        step.axis ? formatted("with a step in the bias of axis {} between them",
                              run.set().axes[static_cast<std::size_t>(*step.axis)])
                  : std::string("with a step in the biases of all axes between them"));
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
