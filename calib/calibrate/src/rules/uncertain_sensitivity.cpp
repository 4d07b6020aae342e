// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Warns of sensitivities with a large standard error.
void find_uncertain_sensitivity(const JudgedRun& run, Warnings& found) {
  if (run.mistakes.culprit) {
    return;
  }
  constexpr double largest_share = 0.1;
  for (Eigen::Index k = 0; k < run.calibration.sensor.response.bias.size() && !by_magnitude(run);
       ++k) {
    const double share = statistics_of(run).sensitivity_se.row(k).norm() /
                         run.calibration.sensor.response.sensitivity.row(k).norm();
    if (share > largest_share && run.estimate.direction.se_rad > 0.0) {
      found.add(WarningCode::uncertain_sensitivity, {},
                formatted("axis {}: these readings determine the sensitivity only to {} %; too "
                          "many readings are left out, or their poses are alike: add readings, or "
                          "use the method 'known' if the table is level",
                          axis_name(run, k), number_text(100.0 * share, 2)));
    }
  }
}

}  // namespace

WarningRule uncertain_sensitivity_rule() {
  return {.name = "uncertain_sensitivity", .find = find_uncertain_sensitivity};
}

}  // namespace axiscal
