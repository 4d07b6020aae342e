// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Permitted probability of a false alarm in a run.
constexpr double false_lack_of_fit = 1e-3;

void find_lack_of_fit(const JudgedRun& run, Warnings& found) {
  // A nonlinear response can look like a saturated axis. Therefore the test is skipped only if a
  // mistake other than saturation was found.
  if (run.mistakes.culprit && run.mistakes.culprit->correction.code != WarningCode::saturated) {
    return;
  }
  const std::vector<LackOfFit>& tests = statistics_of(run).lack_of_fit;
  for (std::size_t k = 0; k < tests.size(); ++k) {
    // If the test was impossible, the p-value is NaN, and there is no warning.
    if (tests[k].p_value * static_cast<double>(tests.size()) < false_lack_of_fit) {
      found.add(
          WarningCode::lack_of_fit, {},
          formatted("axis {}: the deviation of the readings from the model is larger than the "
                    "differences between repeated readings ({}). Possible causes are the faces of "
                    "the cube, its seating or a nonlinear axis. The standard errors include this "
                    "deviation",
                    axis_name(run, static_cast<Eigen::Index>(k)),
                    std::isfinite(tests[k].f)
                        ? formatted("F = {}, p = {}", number_text(tests[k].f, 3),
                                    number_text(tests[k].p_value, 2))
                        : std::string("repeated readings are equal")));
      return;
    }
  }
}

}  // namespace

WarningRule lack_of_fit_rule() {
  return {.name = "lack_of_fit", .find = find_lack_of_fit};
}

}  // namespace axiscal
