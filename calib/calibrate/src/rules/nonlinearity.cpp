// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double false_nonlinearity = 0.005;

void find_nonlinearity(const JudgedRun& run, Warnings& found) {
  const std::optional<CurvatureTest>& curvature = run.tests.curvature;
  // A nonlinear response can look like a saturated axis. Therefore only a mistake other than
  // saturation counts as an explanation.
  const bool explained =
      run.mistakes.culprit && run.mistakes.culprit->correction.code != WarningCode::saturated;
  // If the scatter of an axis increases with the field along it, the ends of the response scatter
  // more than the middle. The test is then stricter.
  const std::vector<ScatterComponent>& components = run.calibration.fit.statistics->components;
  const bool is_noisy_at_ends =
      std::any_of(components.begin(), components.end(),
                  [](const ScatterComponent& one) { return one.name.starts_with("field_"); });
  const double level = false_nonlinearity * (is_noisy_at_ends ? 0.01 : 1.0);
  if (explained || !curvature || !(curvature->p_value < level)) {
    return;
  }
  Eigen::Index most = 0;
  curvature->bends.cwiseAbs().maxCoeff(&most);
  const double bend = curvature->bends(most);
  const std::string text = formatted(
      "the response is not linear (p = {}): at full field, the squared term adds {} "
      "{} to the readings of axis {}",
      number_text(curvature->p_value, 2), number_text(bend, 2),
      run.calibration.sensor.instrument.unit, axis_name(run, most));
  found.add(
      WarningCode::nonlinearity, {},
      by_magnitude(run)
          ? formatted("{}; the biases contain a part of this error. Also fit squared terms "
                      "('squares')",
                      text)
          : formatted("{}, and the bias of this axis includes a third of this error. The "
                      "instrument is nonlinear, or opposite faces of the cube are not parallel: "
                      "give the cube's face normals, or add this error to the uncertainty of "
                      "calibrated readings",
                      text));
}

}  // namespace

WarningRule nonlinearity_rule() {
  return {.name = "nonlinearity", .find = find_nonlinearity};
}

}  // namespace axiscal
