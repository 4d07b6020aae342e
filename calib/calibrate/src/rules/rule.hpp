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

/// Two directions of the field fit equally well.
[[nodiscard]] WarningRule two_solutions_rule();

/// The search for the readings to which the one-sided axes respond does not converge.
[[nodiscard]] WarningRule one_sided_unsettled_rule();

/// The orientations leave a large gap.
[[nodiscard]] WarningRule gap_rule();

/// No reading has a field component along an axis.
[[nodiscard]] WarningRule unseen_axes_rule();

/// The search for mistakes found one.
[[nodiscard]] WarningRule mistake_rule();

/// One rest face shows another slope of the table than the other faces.
[[nodiscard]] WarningRule levelness_rule();

/// Single readings are outliers, and no search for mistakes was made.
[[nodiscard]] WarningRule outliers_rule();

/// A sensitivity has a large standard error.
[[nodiscard]] WarningRule uncertain_sensitivity_rule();

/// The residuals are large.
[[nodiscard]] WarningRule poor_fit_rule();

/// The slope of the table differs between blocks.
[[nodiscard]] WarningRule moved_table_rule();

/// An axis senses mostly along another axis, or with reversed sign.
[[nodiscard]] WarningRule axes_rule();

/// The readings deviate from the model by more than repeated readings differ.
[[nodiscard]] WarningRule lack_of_fit_rule();

/// The response is not linear.
[[nodiscard]] WarningRule nonlinearity_rule();

/// Opposite readings (same rest face, opposite fence faces) contradict the given direction of the
/// field.
[[nodiscard]] WarningRule slope_rule();

/// Method paired left out readings without an opposite reading.
[[nodiscard]] WarningRule unpaired_rule();

/// The fields that the readings state have another length than the field's magnitude.
[[nodiscard]] WarningRule field_magnitude_rule();

/// The design is ill-conditioned.
[[nodiscard]] WarningRule condition_rule();

/// The number of readings equals the number of coefficients.
[[nodiscard]] WarningRule no_redundancy_rule();

/// Several readings of an axis stop at one value.
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
