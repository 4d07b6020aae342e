// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// @return true if the rounding step of an axis is wide relative to the scatter of the axis. The
///         residuals are then rounding errors, not noise.
[[nodiscard]] bool is_coarsely_rounded(const ReadingSet& set,
                                       double stated_step,
                                       const Eigen::VectorXd& residual_sd);

/// @return true if every reading is within one rounding step of the model. Rounding alone may then
///         explain all residuals, and the residuals cannot show a mistake.
[[nodiscard]] bool rounding_explains(const SolvedReadings& of,
                                     double stated_step,
                                     const Estimate& estimate);

/// Allows for rounding in the tests of lack of fit. Repeated readings that round to the same value
/// show no noise, and all of them have the same rounding error. With r readings at each pose, this
/// error adds r step^2 / 12 to the mean square of the poses about the model. The test of an axis
/// includes this contribution if the scatter of its repeated readings is smaller than its rounding
/// step allows.
void allow_for_rounding(const ReadingSet& set, double stated_step, FitStatistics& statistics);

}  // namespace axiscal
