// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/estimation.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Tests for each rest face whether the slope of the table that its readings show agrees with all
/// other readings (method.md, section 5). It compares the differences of the face's opposite
/// positions with their prediction, each axis with its own scatter. The result is stored in the
/// estimate's levelness: the p-value, and the face that disagrees. An estimate without levelness is
/// not changed.
///
/// @param run  the readings that were fitted.
void test_levelness(const SolvedReadings& run, Estimate& estimate);

}  // namespace axiscal
