// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_unpaired(const JudgedRun& run, Warnings& found) {
  if (!run.unpaired_runs.empty()) {
    found.add(
        WarningCode::unpaired, run.unpaired_runs,
        name_of_runs(run.unpaired_runs) +
            ": left out, because the method 'paired' needs the opposite reading (same rest face, "
            "block and level; opposite fence face); take that reading, or use the method 'joint'");
  }
}

}  // namespace

WarningRule unpaired_rule() {
  return {.name = "unpaired", .find = find_unpaired};
}

}  // namespace axiscal
