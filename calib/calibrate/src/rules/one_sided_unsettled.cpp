// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_one_sided_unsettled(const JudgedRun& run, Warnings& found) {
  if (run.estimate.sight.unsettled) {
    found.add(
        WarningCode::one_sided_unsettled, {},
        "the fit does not converge, because in one reading the light is almost perpendicular to "
        "a one-sided axis; move the lamp a little, or leave out that reading");
  }
}

}  // namespace

WarningRule one_sided_unsettled_rule() {
  return {.name = "one_sided_unsettled", .find = find_one_sided_unsettled};
}

}  // namespace axiscal
