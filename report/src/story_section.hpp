// SPDX-License-Identifier: Apache-2.0
// An overview of a run: measured against expected values, the axes in space, and the slope of the
// table. If the orientations are unknown: the cloud of readings before and after the calibration.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "report/src/plot.hpp"

namespace axiscal {

/// @param observations  the readings; may be null. Measured values are then computed from the fit
///                      and its residuals, and the cloud is left out.
std::string story_section(const Calibration& calibration,
                          const Observations* observations,
                          Figures& figures);

}  // namespace axiscal
