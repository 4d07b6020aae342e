// SPDX-License-Identifier: Apache-2.0
// What a run says, at a glance: measured against expected, the axes in space, the slope of the
// table; where the orientations are unknown, the cloud of readings before and after.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "report/src/plot.hpp"

namespace axiscal {

/// @param observations  the readings; null if missing: the measured values are then those of fit
///                      and residuals, without the cloud.
std::string story_section(const Calibration& calibration,
                          const Observations* observations,
                          Figures& figures);

}  // namespace axiscal
