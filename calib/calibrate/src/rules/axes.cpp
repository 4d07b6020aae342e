// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_axes(const JudgedRun& run, Warnings& found) {
  if (run.calibration.sensor.instrument.one_sided ||
      run.calibration.sensor.response.bias.size() > 3) {
    return;  // one-sided axes, and more than three axes, may have any direction
  }
  for (Eigen::Index k = 0; k < run.calibration.sensor.response.bias.size(); ++k) {
    const std::optional<int> nominal = nominal_axis(run.calibration.sensor.instrument, k);
    if (!nominal || !determines_main_sensitivity(run, k)) {
      continue;
    }
    const Eigen::Vector3d row = run.calibration.sensor.response.sensitivity.row(k);
    Eigen::Index main = 0;
    row.cwiseAbs().maxCoeff(&main);
    const std::string letter(1, "xyz"[main]);
    if (main != *nominal) {
      found.add(WarningCode::axis_swapped, {},
                formatted("axis {} is most sensitive along {}{}; are columns exchanged, or is the "
                          "instrument turned in the cube?",
                          axis_name(run, k), row(main) < 0.0 ? "-" : "+", letter));
    } else if (row(main) < 0.0) {
      found.add(
          WarningCode::axis_reversed, {},
          formatted("axis {} is reversed: its sensitivity to {} is negative; check its sign, its "
                    "wiring, and whether each face is labelled as the opposite face",
                    axis_name(run, k), letter));
    }
  }
}

}  // namespace

WarningRule axes_rule() {
  return {.name = "axes", .find = find_axes};
}

}  // namespace axiscal
