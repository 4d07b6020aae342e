// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_two_solutions(const JudgedRun& run, Warnings& found) {
  if (!run.estimate.direction.ambiguity.empty()) {
    found.add(WarningCode::two_solutions, {},
              run.estimate.direction.ambiguity +
                  "; give the approximate direction of the field (its vector in the table's frame, "
                  "or the azimuth of the fence), or name the axes by their directions (x, y, z)");
  }
}

}  // namespace

WarningRule two_solutions_rule() {
  return {.name = "two_solutions", .find = find_two_solutions};
}

}  // namespace axiscal
