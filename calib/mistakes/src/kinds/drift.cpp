// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "calib/mistakes/src/mistake_kind.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::array drift_advice = {
    MistakeAdvice{.code = WarningCode::drift,
                  .one = "Let the instrument warm up, and take the readings in random order."}};

// Returns the columns for a linear drift of each axis's bias over the run.
Eigen::MatrixXd drift_columns(const SuspectRun& run) {
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), run.m());
  for (std::size_t at = 0; at < run.count(); ++at) {
    const double along =
        static_cast<double>(at) / std::max(1.0, static_cast<double>(run.n() - 1)) - 0.5;
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      Z(run.n() * k + static_cast<Eigen::Index>(run.order()[at]), k) = along;
    }
  }
  return Z;
}

HypothesisFit fit_drift(const SuspectRun& run) {
  return run.fitter().fit(run.set(), {},
                          [&](const auto&, const auto&) { return drift_columns(run); });
}

double quick_p_of_drift(const SuspectRun& run, const HypothesisFit& fit) {
  return nested_f_p(fit.total(), fit.dof(), run.rss_drop_with_columns(fit, drift_columns(run)),
                    static_cast<double>(run.m()));
}

void detect_drift(const SuspectRun& run, const Consider& consider) {
  consider(fit_drift(run), {});
}

void explain_by_drift(const SuspectRun& run, Explanations& found) {
  std::vector<double> ranges;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    ranges.push_back(drift_range * run.full_response(k));
  }
  found.add(fit_drift(run), ranges, 1.0, Correction{.code = WarningCode::drift},
            "with a drift of the bias over the run");
  // A drift of a single axis needs only one parameter, as does a step of its bias.
  if (run.m() == 1) {
    return;
  }
  const auto m = static_cast<double>(run.m());
  const Eigen::MatrixXd columns = drift_columns(run);
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    HypothesisFit fit = run.fitter().fit(
        run.set(), {}, [&](const auto&, const auto&) { return Eigen::MatrixXd(columns.col(k)); });
    found.add(std::move(fit), {drift_range * run.full_response(k)}, m,
              Correction{.code = WarningCode::drift},
              formatted("with a drift of the bias of axis {} over the run",
                        run.set().axes[static_cast<std::size_t>(k)]));
  }
}

}  // namespace

MistakeKind drift_kind() {
  return {.advice = drift_advice,
          .of_run = explain_by_drift,
          .quick_p = quick_p_of_drift,
          .detect = detect_drift,
          .of_all_axes = fit_drift};
}

}  // namespace axiscal
