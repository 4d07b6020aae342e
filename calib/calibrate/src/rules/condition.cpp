// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_condition(const JudgedRun& run, Warnings& found) {
  if (statistics_of(run).condition_number > largest_good_condition) {
    found.add(
        WarningCode::ill_conditioned, {},
        formatted(
            "the design is ill-conditioned (condition number {}; a standard design has "
            "less than 5), so standard errors are large; {}",
            number_text(statistics_of(run).condition_number, 3),
            run.calibration.sensor.instrument.one_sided
                ? "take all 24 points, or move the lamp away from the cube's diagonal"
            : method_kind(run.calibration.fit.method).by_magnitude
                ? "add orientations in all directions"
                : "repeat the reading on each rest face with the opposite face at the fence"));
  }
}

}  // namespace

WarningRule condition_rule() {
  return {.name = "condition", .find = find_condition};
}

}  // namespace axiscal
