// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/estimation.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Tests for each rest face whether its readings show the same slope of the table as all other
/// readings (method.md, section 5). The test compares the differences between readings with
/// opposite fence faces with the prediction from the other readings. The scatter is estimated
/// separately for each axis.
///
/// The p-value and the face that disagrees are stored in estimate.levelness. If the estimate has no
/// levelness, it is not changed.
///
/// @param run  the readings that were fitted.
void test_levelness(const SolvedReadings& run, Estimate& estimate);

}  // namespace axiscal
