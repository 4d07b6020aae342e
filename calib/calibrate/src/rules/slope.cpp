// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double false_slope = 0.005;

// Returns the stated standard uncertainty of the slope, i.e. of the field's component along the
// table's x or y, divided by the field's magnitude.
double stated_slope_u(const JudgedRun& run) {
  double variance = 0.0;
  if (run.calibration.fit.uncertainty) {
    for (const UncertaintySource& source : run.calibration.fit.uncertainty->sources) {
      if (source.name == "levelness" || source.name == "field direction") {
        variance += source.input_u * source.input_u;
      }
    }
  }
  return std::sqrt(variance);
}

// Tests whether the slope measured by opposite readings (same rest face, opposite fence faces)
// differs from the slope of the stated field. It is an F test with 2 degrees of freedom in the
// numerator. The variance of the difference is the variance of the measured slope plus the stated
// variance.
void find_slope(const JudgedRun& run, Warnings& found) {
  const std::optional<Levelness>& levelness = run.calibration.fit.levelness;
  if (!method_kind(run.calibration.fit.method).directions_known || !levelness ||
      !run.calibration.sensor.field.in_table) {
    return;
  }
  const Eigen::Vector3d given =
      *run.calibration.sensor.field.in_table / run.calibration.sensor.field.magnitude;
  const Eigen::Array2d off(levelness->mean_x - given.x(), levelness->mean_y - given.y());
  const Eigen::Array2d own =
      Eigen::Array2d(levelness->standard_error_x, levelness->standard_error_y).square();
  const Eigen::Array2d all = own + stated_slope_u(run) * stated_slope_u(run);
  const double share = (own / all).mean();
  constexpr double rounding = 1e-9;
  const double p = f_upper_p(0.5 * (off.square() / all).sum(), 2.0,
                             levelness->degrees_of_freedom / (share * share));
  // With zero degrees of freedom, p is NaN, and there is no warning.
  if (off.abs().maxCoeff() > rounding && p < false_slope) {
    found.add(WarningCode::slope, {},
              formatted("the stated field has the components {}, {} in the table's plane (divided "
                        "by the field's magnitude), but opposite readings give {}, {}. Use the "
                        "method 'paired' or 'joint', or correct the stated slope",
                        number_text(given.x(), 4), number_text(given.y(), 4),
                        number_text(levelness->mean_x, 4), number_text(levelness->mean_y, 4)));
  }
}

}  // namespace

WarningRule slope_rule() {
  return {.name = "slope", .find = find_slope};
}

}  // namespace axiscal
