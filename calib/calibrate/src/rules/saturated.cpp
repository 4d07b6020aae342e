// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Warns of axes whose readings do not go beyond one value although the fit predicts larger values
// (or, at the lower end, smaller values).
void find_saturated(const JudgedRun& run, Warnings& found) {
  for (const SaturatedAxis& axis : run.tests.saturated) {
    found.add(
        WarningCode::saturated, axis.runs,
        formatted("{}: the readings of axis {} stop at {}, but the other readings predict values "
                  "beyond this limit: the axis is saturated, or its response is not linear near "
                  "this limit; give the axis's range, or set the instrument to a range that "
                  "includes the field",
                  name_of_runs(axis.runs), axis_name(run, axis.axis), number_text(axis.value, 8)));
  }
}

}  // namespace

WarningRule saturated_rule() {
  return {.name = "saturated", .find = find_saturated};
}

}  // namespace axiscal
