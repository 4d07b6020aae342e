// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/estimation.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Whether the slope of the table by one rest face agrees with what all other readings say: the
/// differences of its opposite positions against their prediction, each axis by its own scatter
/// (method.md, section 5). Puts the probability, and the face that disagrees, into the estimate's
/// levelness; nothing where it has none.
///
/// @param run  the readings that were fitted.
void test_levelness(const SolvedReadings& run, Estimate& estimate);

}  // namespace axiscal
