// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_field_magnitude(const JudgedRun& run, Warnings& found) {
  if (!method_kind(run.calibration.fit.method).directions_known ||
      run.calibration.sensor.field.in_table) {
    return;
  }
  constexpr double largest_deviation = 0.05;
  if (run.field_varies) {
    return;
  }
  const double ratio = run.estimate.mean_field / run.calibration.sensor.field.magnitude;
  if (!(std::abs(ratio - 1.0) <= largest_deviation)) {
    found.add(
        WarningCode::field_magnitude, {},
        formatted("the vectors in the columns fx, fy, fz have a mean length of {}, but the field's "
                  "magnitude is {} {}; correct the unit, or give the magnitude",
                  number_text(run.estimate.mean_field, 4),
                  number_text(run.calibration.sensor.field.magnitude, 4),
                  run.calibration.sensor.field.unit));
  }
}

}  // namespace

WarningRule field_magnitude_rule() {
  return {.name = "field_magnitude", .find = find_field_magnitude};
}

}  // namespace axiscal
