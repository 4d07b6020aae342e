// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double false_moved_table = 1e-3;

void find_moved_table(const JudgedRun& run, Warnings& found) {
  const std::optional<Levelness>& levelness = run.calibration.fit.levelness;
  if (levelness && levelness->block_p_value < false_moved_table) {
    found.add(
        WarningCode::table_moved, {},
        formatted("the table's slope differs between blocks (p = {}): the table was moved, so one "
                  "slope for all blocks is wrong; fit one slope for each block ('level_by')",
                  number_text(levelness->block_p_value, 2)));
  }
}

}  // namespace

WarningRule moved_table_rule() {
  return {.name = "moved_table", .find = find_moved_table};
}

}  // namespace axiscal
