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

/// Warns if the direction of the field has a large standard error.
[[nodiscard]] WarningRule uncertain_direction_rule();

/// Warns if two directions of the field fit equally well.
[[nodiscard]] WarningRule two_solutions_rule();

/// Warns if the search for the usable readings of one-sided axes did not converge.
[[nodiscard]] WarningRule one_sided_unsettled_rule();

/// Warns if the orientations leave a large part of the sphere without readings.
[[nodiscard]] WarningRule gap_rule();

/// Warns if the field has no component along an axis in any reading.
[[nodiscard]] WarningRule unseen_axes_rule();

/// Warns if the search for mistakes found one.
[[nodiscard]] WarningRule mistake_rule();

/// Warns if the slope of the table measured on one rest face disagrees with the other faces.
[[nodiscard]] WarningRule levelness_rule();

/// Warns of outliers if the readings were not searched for mistakes.
[[nodiscard]] WarningRule outliers_rule();

/// Warns if a sensitivity has a large standard error.
[[nodiscard]] WarningRule uncertain_sensitivity_rule();

/// Warns if the residuals are large.
[[nodiscard]] WarningRule poor_fit_rule();

/// Warns if the slope of the table differs between blocks.
[[nodiscard]] WarningRule moved_table_rule();

/// Warns if an axis senses mainly the nominal component of another axis, or senses its own nominal
/// component with reversed sign.
[[nodiscard]] WarningRule axes_rule();

/// Warns if the readings deviate from the model by more than the scatter of repeated readings.
[[nodiscard]] WarningRule lack_of_fit_rule();

/// Warns if the response is not linear.
[[nodiscard]] WarningRule nonlinearity_rule();

/// Warns if opposite readings (same rest face, opposite fence faces) contradict the stated
/// direction of the field.
[[nodiscard]] WarningRule slope_rule();

/// Warns if method `paired` left out readings that have no opposite reading.
[[nodiscard]] WarningRule unpaired_rule();

/// Warns if the fields stated with the readings do not have the stated magnitude.
[[nodiscard]] WarningRule field_magnitude_rule();

/// Warns if the design is ill-conditioned.
[[nodiscard]] WarningRule condition_rule();

/// Warns if there are only as many readings as coefficients.
[[nodiscard]] WarningRule no_redundancy_rule();

/// Warns if an axis is saturated: several of its readings stop at the same value.
[[nodiscard]] WarningRule saturated_rule();

[[nodiscard]] inline const FitStatistics& statistics_of(const JudgedRun& run) {
  return *run.calibration.fit.statistics;
}

[[nodiscard]] inline const std::string& axis_name(const JudgedRun& run, Eigen::Index k) {
  return run.calibration.sensor.instrument.axes[static_cast<std::size_t>(k)];
}

/// @return the full response of axis k [unit]: the magnitude of its sensitivity times the magnitude
///         of the field.
[[nodiscard]] double full_response(const JudgedRun& run, Eigen::Index k);

/// @return true if the readings determine the sensitivity of an axis to its nominal component.
[[nodiscard]] bool determines_main_sensitivity(const JudgedRun& run, Eigen::Index k);

[[nodiscard]] bool by_magnitude(const JudgedRun& run);

}  // namespace axiscal
