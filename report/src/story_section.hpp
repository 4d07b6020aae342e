// SPDX-License-Identifier: Apache-2.0
// The overview of a run in a report. It shows the measured against the expected values, the axes in
// space, and the slope of the table. If the orientations are unknown, it shows the cloud of
// readings before and after the calibration instead.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "report/src/plot.hpp"

namespace axiscal {

/// @param observations  observations of the calibration; may be null. If it is null, the measured
///                      values are computed from the fit and its residuals, and the cloud is left
///                      out.
std::string story_section(const Calibration& calibration,
                          const Observations* observations,
                          Figures& figures);

}  // namespace axiscal
