// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// If the standard error of the field's direction is above this limit, the direction counts as
// unknown, and so do the sensitivities S.
constexpr double largest_direction_se_rad = 0.05;

void find_uncertain_direction(const JudgedRun& run, Warnings& found) {
  if (run.estimate.direction.se_rad > largest_direction_se_rad) {
    found.add(
        WarningCode::uncertain_direction, {},
        formatted(
            "the readings hardly determine the field's direction in the table's frame (standard "
            "error {} rad), so the sensitivities are uncertain; repeat the reading on each rest "
            "face with the opposite face at the fence, or use the method 'known' if the table is "
            "level",
            number_text(run.estimate.direction.se_rad, 2)));
  }
}

}  // namespace

WarningRule uncertain_direction_rule() {
  return {.name = "uncertain_direction", .find = find_uncertain_direction};
}

}  // namespace axiscal
