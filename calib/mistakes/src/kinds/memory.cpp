// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "calib/fit/run_effects.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array memory_advice = {MistakeAdvice{
    .code = WarningCode::memory,
    .one = "Exercise the instrument over its whole range before each reading, and wait longer."}};

// Largest fraction of the difference from the previous reading that may remain in a reading.
constexpr double memory_range = 0.05;

// Returns the columns for hysteresis, one for each axis. With hysteresis, a reading keeps a part of
// the previous reading. The entries are the previous reading minus the present one, in units of the
// axis's full response.
Eigen::MatrixXd memory_columns(const SuspectRun& run) {
  const Eigen::MatrixXd changes = previous_minus_current(run.set().readings, run.set().response);
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), run.m());
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    Z.col(k).segment(run.n() * k, run.n()) = changes.col(k) / run.full_response(k);
  }
  return Z;
}

HypothesisFit fit_memory(const SuspectRun& run) {
  return run.fitter().fit(run.set(), {},
                          [&](const auto&, const auto&) { return memory_columns(run); });
}

double quick_p_of_memory(const SuspectRun& run, const HypothesisFit& fit) {
  return nested_f_p(fit.total(), fit.dof(), run.rss_drop_with_columns(fit, memory_columns(run)),
                    static_cast<double>(run.m()));
}

void detect_memory(const SuspectRun& run, const Consider& consider) {
  consider(fit_memory(run), {});
}

void explain_by_memory(const SuspectRun& run, Explanations& found) {
  std::vector<double> ranges;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    ranges.push_back(memory_range * run.full_response(k));
  }
  found.add(fit_memory(run), ranges, 1.0, Correction{.code = WarningCode::memory},
            "if each reading keeps a part of the change since the previous reading");
}

}  // namespace

MistakeKind memory_kind() {
  return {.advice = memory_advice,
          .of_run = explain_by_memory,
          .quick_p = quick_p_of_memory,
          .detect = detect_memory,
          .of_all_axes = fit_memory};
}

}  // namespace axiscal
