// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// @return True if the rounding step is wide relative to an axis's scatter: then the residuals are
///         rounding errors, not noise.
[[nodiscard]] bool is_coarsely_rounded(const ReadingSet& set,
                                       double stated_step,
                                       const Eigen::VectorXd& residual_sd);

/// @return True if every reading is within one rounding step of the model. Rounding alone may then
///         explain all residuals, and the residuals cannot show a mistake.
[[nodiscard]] bool rounding_explains(const SolvedReadings& of,
                                     double stated_step,
                                     const Estimate& estimate);

/// Allows for rounding in the tests of lack of fit. Repeats that round to the same digit show no
/// noise, and all readings in a pose share the error of that digit. With r readings in each pose,
/// this contributes r step^2 / 12 to the mean square of the poses about the model. If the repeats
/// of an axis agree better than its step allows, its test includes this contribution.
void allow_for_rounding(const ReadingSet& set, double stated_step, FitStatistics& statistics);

}  // namespace axiscal
