// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/calibrate/warning_rule.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/mistakes/culprit.hpp"

namespace axiscal {

/// The direction of the field has a large standard error.
[[nodiscard]] WarningRule uncertain_direction_rule();

/// Two directions of the field fit alike.
[[nodiscard]] WarningRule two_solutions_rule();

/// The readings that one-sided axes see do not settle.
[[nodiscard]] WarningRule one_sided_unsettled_rule();

/// No reading has the field near some direction.
[[nodiscard]] WarningRule gap_rule();

/// The fields lack a component along an axis.
[[nodiscard]] WarningRule unseen_axes_rule();

/// The search for mistakes found one.
[[nodiscard]] WarningRule mistake_rule();

/// One face shows another slope of the table.
[[nodiscard]] WarningRule levelness_rule();

/// Single readings stand out, if no search judged them.
[[nodiscard]] WarningRule outliers_rule();

/// A sensitivity has a large standard error.
[[nodiscard]] WarningRule uncertain_sensitivity_rule();

/// The residuals are large.
[[nodiscard]] WarningRule poor_fit_rule();

/// The slope of the table differs between blocks.
[[nodiscard]] WarningRule moved_table_rule();

/// An axis reads along another one, or reversed.
[[nodiscard]] WarningRule axes_rule();

/// Repeats agree better than the model fits them.
[[nodiscard]] WarningRule lack_of_fit_rule();

/// The response is not straight.
[[nodiscard]] WarningRule nonlinearity_rule();

/// Opposite readings contradict the given direction of the field.
[[nodiscard]] WarningRule slope_rule();

/// Readings without their opposite were left out.
[[nodiscard]] WarningRule unpaired_rule();

/// The fields that the readings bring have another length.
[[nodiscard]] WarningRule field_magnitude_rule();

/// The design hardly tells coefficients apart.
[[nodiscard]] WarningRule condition_rule();

/// There are just as many readings as coefficients.
[[nodiscard]] WarningRule no_redundancy_rule();

/// An axis reads its end value several times.
[[nodiscard]] WarningRule saturated_rule();

[[nodiscard]] inline const FitStatistics& statistics_of(const JudgedRun& run) {
  return *run.calibration.fit.statistics;
}

[[nodiscard]] inline const std::string& axis_name(const JudgedRun& run, Eigen::Index k) {
  return run.calibration.sensor.instrument.axes[static_cast<std::size_t>(k)];
}

/// @return |S_k| F of an axis [unit].
[[nodiscard]] double full_response(const JudgedRun& run, Eigen::Index k);

/// @return true if the readings determine the sensitivity of an axis to its nominal component.
[[nodiscard]] bool determines_main_sensitivity(const JudgedRun& run, Eigen::Index k);

[[nodiscard]] bool by_magnitude(const JudgedRun& run);

}  // namespace axiscal
