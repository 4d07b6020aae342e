// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_gap(const JudgedRun& run, Warnings& found) {
  const auto& quality = run.calibration.fit.orientations;
  if (quality && quality->largest_gap_rad > largest_good_gap_rad) {
    found.add(
        WarningCode::coverage, {},
        formatted("the orientations leave a gap: the direction {} of the sensor is {} degrees from "
                  "the nearest reading; add orientations in which the field has this direction",
                  direction_in_words(quality->gap),
                  number_text(quality->largest_gap_rad * deg_per_rad, 2)));
  }
}

}  // namespace

WarningRule gap_rule() {
  return {.name = "gap", .find = find_gap};
}

}  // namespace axiscal
